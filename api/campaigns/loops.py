"""The curves of force over displacement and over velocity of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from api.errors import InputError
from rigctl.runfile import Run

__all__ = ["loops"]

_LEAST_PERIOD = 8
_LEAST_SAMPLES = 64


def loops(run: Run, points: int) -> dict[str, JsonValue]:
    """Displacement (m), velocity (m/s) and force (N) of a run as equally long lists of at most ``points``.

    A periodic run gives its last period, closed, with the exact derivative of the mean period; any other run is given
    whole, with a smoothing derivative. Samples are left out evenly, never averaged.

    Raises InputError where the run has no displacement or no force, or is too short.
    """
    lacking = [name for name in ("displacement", "force") if name not in run.channels]
    if lacking:
        raise InputError(f"run {run.run_id} has no channel {lacking[0]!r}: it cannot be drawn")
    if run.samples < _LEAST_SAMPLES:
        raise InputError(f"run {run.run_id} has {run.samples} samples: a chart needs {_LEAST_SAMPLES}")
    x, v, force, closed = _motion(run)
    chosen = np.arange(0, x.size, -(-x.size // (points - closed)))
    if closed:
        chosen = np.append(chosen, 0)  # a loop without a gap
    return {
        "test": run.test_id,
        "status": run.status,
        "displacement_m": x[chosen].tolist(),
        "velocity_m_s": v[chosen].tolist(),
        "force_n": force[chosen].tolist(),
    }


def _motion(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], bool]:
    """Displacement, velocity and force, each (n,); whether they are one period."""
    from identification.derivatives import periodic_kinematics  # half a second: a service that starts does not wait
    from identification.smoothing import smooth_kinematics

    x, force, period = run.channels["displacement"], run.channels["force"], run.period_samples
    periods = run.samples // period if period >= _LEAST_PERIOD else 0
    if periods < 2:
        smooth = smooth_kinematics(x, run.sample_rate_hz)
        return smooth.x, smooth.v, force, False
    settled = x[period : periods * period].reshape(periods - 1, period)
    motion = periodic_kinematics(settled, run.sample_rate_hz)
    return motion.x, motion.v, force[(periods - 1) * period : periods * period], True
