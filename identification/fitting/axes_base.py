"""The physical model of the main axis under a model of several axes: given, or the better of two that are fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.blackbox import Base
from identification.errors import DataError
from identification.fitting.base import STARTS, simple_base
from identification.fitting.fit import fit
from identification.models.simulation import name_of, simulate_run
from identification.physical.literature import literature
from identification.physical.model import Model
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run

_MAIN = ("displacement", "force")
_BUSHED = "piecewise linear with bush"  # a dashpot of two slopes in series with a bush (Umehara et al.)


def axes_base(given: Model | None, runs: Sequence[Run]) -> Base:
    """The model that is given, else a dashpot behind a bush or one with a yield, whichever fits the main axis better.

    Fitted to `runs`, of which the displacement and the force of the main axis are used. Raises DataError as `fit` does.
    """
    if given is not None:
        return Base(given, model_to_json(given))
    main = [_main_axis(one) for one in runs]
    fitted = [fit(literature(_BUSHED), main, starts=STARTS).model, simple_base(main)]
    best = min(fitted, key=lambda model: _left(model, main))
    return Base(best, model_to_json(best))


def _left(model: Model, runs: Sequence[Run]) -> float:
    """The rms of what a model leaves, N."""
    left = np.concatenate([one.channels["force"] - simulate_run(model, one) for one in runs])
    return float(np.sqrt(np.mean(left**2)))


def _main_axis(run: Run) -> Run:
    """The displacement and the force of the main axis alone; raises DataError where one is missing."""
    missing = next((name for name in _MAIN if name not in run.channels), None)
    if missing is not None:
        raise DataError(f"{name_of(run)} has no {missing}, which the base of the main axis needs: record it")
    return replace(run, channels={name: run.channels[name] for name in _MAIN})
