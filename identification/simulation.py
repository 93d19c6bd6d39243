"""Free-run simulation of a model along a run, from the run's inputs alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.physical.accuracy import simulate_within
from identification.physical.model import Model, is_controlled
from identification.physical.motion import Motion
from identification.physical.simulate import simulate
from identification.record import motion_of
from rigctl.runfile import Run


def simulate_run(model: Model, run: Run) -> NDArray[np.float64]:
    """Force of the model along a run's displacement, current and temperature, (N,), N, for every sample of the run.

    Raises DataError as `simulate_run_within` does.
    """
    motion = _checked_motion(model, run)
    return _whole(simulate(model, motion).force, motion, run)


def simulate_run_within(model: Model, run: Run, tolerance: float) -> tuple[NDArray[np.float64], float]:
    """The same with samples divided until the solver's own error is below `tolerance` of the force; and that error.

    Raises
    ------
    DataError
        when the run lacks the displacement, or a current that the model needs, or holds no motion at all.
    """
    motion = _checked_motion(model, run)
    refined = simulate_within(model, motion, tolerance)
    return _whole(refined.force, motion, run), refined.relative


def _checked_motion(model: Model, run: Run) -> Motion:
    name = run.path.name if run.path is not None else run.run_id
    if "displacement" not in run.channels:
        raise DataError(f"{name}: no channel 'displacement': the model is driven by the measured displacement")
    if run.samples < 2:
        raise DataError(f"{name}: only {run.samples} sample: a motion has at least 2")
    if model.needs_current and "current" not in run.channels:
        needs = next(e.name for e in model.elements if e.spec.needs_current or is_controlled(e))
        raise DataError(f"{name} has no control current, which '{needs}' needs: record it or leave it out")
    return motion_of(run)


def _whole(force: NDArray[np.float64], motion: Motion, run: Run) -> NDArray[np.float64]:
    """The force for every sample: a periodic run that ends within a period goes on as its periods do."""
    missing = run.samples - force.size
    return np.concatenate([force, np.resize(force[-motion.period :], missing)]) if missing > 0 else force
