"""A hybrid: a model whose parts have names, and a network for what that leaves, which ends where its training ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_from_json, blackbox_to_json
from identification.blackbox.samples import course_along
from identification.blackbox.scaling import MARGIN
from identification.errors import ModelError
from identification.models.modelfile import FORMAT, FORMAT_VERSION, Json, model_from_json
from identification.models.motion import Motion
from identification.models.protocol import SIGNALS, SimulationModel, TrainingRange

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hybrid:
    """F = F_base + w·F_rest: w is 1 within the training range and falls to 0 at half of its span beyond.

    So far outside the training the base alone remains. `base_file` is the content of the model file of the base.
    """

    name: str
    base: SimulationModel
    base_file: Mapping[str, Json]
    rest: BlackBox

    @property
    def kind(self) -> str:
        """The word in its file."""
        return "hybrid"

    @property
    def facts(self) -> Mapping[str, float]:
        """Figures of its identification."""
        return self.rest.facts

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        return {**self.rest.inputs, **self.base.inputs}

    @property
    def training_range(self) -> TrainingRange | None:
        """Where the network holds; beyond, the base remains."""
        return self.rest.training_range

    def names(self) -> Sequence[str]:
        """The parameters of the base, then the weights."""
        return [*self.base.names(), *self.rest.names()]

    def values(self) -> Floats:
        """The parameters of the base, SI, then the weights."""
        return np.concatenate([self.base.values(), self.rest.values()])

    def free(self) -> NDArray[np.bool_]:
        """Which of them a fit may move."""
        return np.concatenate([self.base.free(), self.rest.free()])

    def bounds(self) -> tuple[Floats, Floats]:
        """Their bounds."""
        (low, high), (lowest, highest) = self.base.bounds(), self.rest.bounds()
        return np.concatenate([low, lowest]), np.concatenate([high, highest])

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N; raises SimulationError as its base does."""
        base, rest = self.parts(motion)
        return base + rest

    def parts(self, motion: Motion) -> tuple[Floats, Floats]:
        """The force of the base and that of the network, each (N,), N."""
        base = self.base.force(motion)
        return base, self.share(motion) * self.rest.along(course_along(motion, base))

    def share(self, motion: Motion) -> Floats:
        """The weight w of the network, (N,)."""
        weight = np.ones(motion.x.size)
        known = self.training_range
        for signal, (low, high) in known.limits.items() if known else ():
            series = getattr(motion, SIGNALS[signal])
            beyond = np.maximum(np.maximum(low - series, series - high), 0.0)
            weight = np.minimum(weight, np.maximum(1.0 - beyond / (MARGIN * (high - low)), 0.0))
        return weight


def hybrid_to_json(model: Hybrid) -> dict[str, Json]:
    """The model as JSON data."""
    head = {"format": FORMAT, "format_version": FORMAT_VERSION, "name": model.name, "kind": model.kind}
    return head | {"base": dict(model.base_file), "rest": blackbox_to_json(model.rest)}


def hybrid_from_json(data: Json) -> Hybrid:
    """A hybrid from parsed JSON; raises ModelError with the place and the cure."""
    parts: dict[str, SimulationModel] = {}
    readers = {"base": lambda part: model_from_json(part, only=("physical",)), "rest": blackbox_from_json}
    for name, reader in readers.items():
        try:
            parts[name] = reader(data.get(name))
        except ModelError as error:
            raise ModelError(f"{name}: {error}") from error
    rest = parts["rest"]
    assert isinstance(rest, BlackBox)  # by its reader
    return Hybrid(name=data.get("name", ""), base=parts["base"], base_file=data["base"], rest=rest)
