"""Simulation of a physical model along a run to a stated numerical error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.models.simulation import checked_motion, for_every_sample
from identification.physical.accuracy import simulate_within
from identification.physical.model import Model
from rigctl.runfile import Run


def simulate_run_within(model: Model, run: Run, tolerance: float) -> tuple[NDArray[np.float64], float]:
    """Force (N,), N, with samples divided until the solver's own error is below `tolerance` of it; and that error.

    Raises DataError and SimulationError as `simulate_run` does.
    """
    motion = checked_motion(model, run)
    refined = simulate_within(model, motion, tolerance)
    return for_every_sample(refined.force, motion, run), refined.relative
