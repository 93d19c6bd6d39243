"""The independent work of a complexity study, fits and answers of steps, on the executor and kept in the journal."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.errors import SimulationError
from identification.fitting import fit
from identification.physical.model import Model
from identification.physical.modelfile import model_to_json
from identification.studies.complexity.plan import Step
from identification.studies.journal import carried, key_of
from identification.studies.pace import Tell
from rigctl.runfile import Run

Floats = NDArray[np.float64]


class Fits:
    """Fits of models to the same runs."""

    def __init__(self, runs: Sequence[Run]) -> None:
        """Of these runs."""
        self._runs = tuple(runs)
        found = hashlib.sha256()
        for one in runs:
            found.update(repr((one.run_id, one.sample_rate_hz, one.period_samples, one.excitation_kind)).encode())
            for name, series in one.channels.items():
                found.update(name.encode() + np.ascontiguousarray(series).tobytes())
        self._identity = found.digest()

    def __call__(self, model: Model) -> Floats:
        """Misfit, values and standard deviations of the fitted model, (1 + 2P,)."""
        found = fit(model, self._runs)
        stds = [np.nan if (s := e.parameters[k].std) is None else s for e, k in found.model.slots()]
        return np.array([found.chi2, *found.model.values(), *stds])

    def of(self, models: Sequence[Model], tell: Tell, what: str) -> list[tuple[float, Model]]:
        """Misfit and fitted model of each."""
        keys = [key_of(b"fit", self._identity, content(model)) for model in models]
        found = carried(self, models, keys, what=what, tell=tell)
        return [(float(one[0]), _fitted(model, one)) for model, one in zip(models, found, strict=True)]


def _fitted(model: Model, found: Floats) -> Model:
    count = (found.size - 1) // 2
    return model.with_values(found[1 : 1 + count]).with_std(found[1 + count :])


class _Answer:
    """A task: the output of a step."""

    def __init__(self, step: Step) -> None:
        self._step = step

    def __call__(self, model: Model) -> Floats:
        try:
            return np.array([self._step(model)])
        except SimulationError:
            return np.array([np.inf])  # such a model does not do for this step


def answers(step: Step, models: Sequence[Model], tell: Tell) -> list[float]:
    """The output of a step with each of the models; infinite where its simulation fails."""
    try:
        identity = pickle.dumps(step, protocol=5)
    except (pickle.PicklingError, AttributeError, TypeError):  # of a notebook: asked again each time
        identity = repr((step, id(step))).encode()
    keys = [key_of(b"step", identity, content(model)) for model in models]
    found = carried(_Answer(step), models, keys, what=step.name, tell=tell)
    return [float(one[0]) for one in found]


def content(model: Model) -> bytes:
    """What tells a model from others."""
    return json.dumps(model_to_json(model), sort_keys=True).encode()
