"""Faults of a measured motion: a displacement that jumps, and a velocity that is not that of the displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from identification.smoothing import smooth_kinematics
from rigctl.runfile import Run

Floats = NDArray[np.float64]

# A motion that is sampled ten times a cycle or more has steps between samples that are alike: the median of the four
# before and the four after one is at least half of it, also where the machine starts. Half of the factor: a start whose
# first step is the largest; double: a jump of 20 steps is left.
_BESIDE = 4  # steps on each side
_JUMP = 10.0  # times their median and the resolution
_FASTEST, _ALLOWED = 0.9, 3.0  # and this many times the steps that nine tenths of the record stay below

# The share of its variance that a velocity has in common with the derivative of the displacement. A sensor with noise
# of half of its signal has 0.8; noise alone 0. Half: a velocity whose noise is as large as its signal is used.
_SHARED = 0.5
_OTHER_UNIT = 2.0  # or half: of the size of that derivative. No sensor is so wrong, but mm/s, inches and g are.
_FROZEN = 1e-12  # m/s: a velocity that moves by less is that of no sensor
_FEWEST = 64  # samples from which a velocity is compared


@dataclass(frozen=True, slots=True)
class Jump:
    """Between sample `at` − 1 and `at` the displacement moves by `by`, m, where its motion allows `allowed`, m."""

    at: int
    by: float
    allowed: float


def jumps_in(run: Run) -> list[Jump]:
    """Where the displacement of a run moves farther from one sample to the next than its motion allows.

    A step is a jump where it is `_JUMP` times the median of its neighbours, `_ALLOWED` times the steps that nine
    tenths of the record stay below, and no measured velocity bears it out. A value that is wrong for one sample makes
    two jumps; one that comes again in the period before or after is none.
    """
    steps = np.diff(run.channels["displacement"])
    allowed = _allowed(steps)
    if "velocity" in run.channels and np.any(np.abs(steps) > allowed) and velocity_fault(run) is None:
        v = np.abs(run.channels["velocity"])
        allowed = np.maximum(allowed, _ALLOWED * np.maximum(v[1:], v[:-1]) / run.sample_rate_hz)
    found = np.flatnonzero(np.abs(steps) > allowed)
    if run.period_samples:  # what every period has belongs to the motion
        found = found[~(np.isin(found + run.period_samples, found) | np.isin(found - run.period_samples, found))]
    return [Jump(int(k) + 1, float(steps[k]), float(allowed[k])) for k in found]


def _allowed(steps: Floats) -> Floats:
    """How far a displacement may move from one sample to the next by its own steps (N,), m, (N,)."""
    size = np.abs(steps)
    if size.size < 4 * _BESIDE or not np.any(size > 0.0):
        return np.full(size.size, np.inf)
    resolution = float(np.percentile(size[size > 0.0], 10))
    windows = sliding_window_view(np.pad(size, _BESIDE, mode="reflect"), 2 * _BESIDE + 1)
    beside = np.median(np.delete(windows, _BESIDE, axis=1), axis=1)
    return np.asarray(np.maximum(_JUMP * (beside + resolution), _ALLOWED * float(np.quantile(size, _FASTEST))))


def jump_fault(run: Run) -> str | None:
    """What is wrong with a displacement that jumps, in one line; None where it does not."""
    jumps = jumps_in(run)
    if not jumps:
        return None
    first, rate = jumps[0], run.sample_rate_hz
    more = f", and at {len(jumps) - 1} more places" if len(jumps) > 1 else ""
    return (
        f"it jumps by {1e3 * first.by:.3g} mm from {(first.at - 1) / rate:.3f} to {first.at / rate:.3f} s, where its "
        f"motion allows {1e3 * first.allowed:.2g} mm{more}: samples are missing or its sensor slipped; "
        "cut the run there"
    )


def velocity_fault(run: Run) -> str | None:
    """What is wrong with a measured velocity beside the displacement, in one line; None where nothing is.

    It is compared with the derivative of the displacement without its jumps, by the share of the variance that both
    have in common.
    """
    v = run.channels.get("velocity")
    if v is None or v.size < _FEWEST or np.ptp(run.channels["displacement"]) == 0.0:
        return None
    if np.ptp(v) <= _FROZEN:
        return f"it is frozen at {v[0]:.4g} m/s: check its sensor, or leave it out"
    x = run.channels["displacement"]
    steps = np.diff(x)
    without = np.concatenate([x[:1], x[0] + np.cumsum(np.where(np.abs(steps) > _allowed(steps), 0.0, steps))])
    derived = smooth_kinematics(without, run.sample_rate_hz).v
    one, other = v - v.mean(), derived - derived.mean()
    both = float(np.linalg.norm(one) * np.linalg.norm(other))
    alike = float(one @ other) / both if both > 0.0 else 0.0
    if alike < 0.0 and alike**2 >= _SHARED:
        return (
            f"it is against the derivative of the displacement, correlation {alike:.2f}: one of their signs is reversed"
        )
    if alike**2 < _SHARED:
        return (
            f"it shares {100.0 * alike**2:.2g} % of its variance with the derivative of the displacement, a measured "
            f"one {100.0 * _SHARED:g} % or more: it is noise or another channel; leave it out"
        )
    ratio = float(one @ other) / float(other @ other)
    if not 1.0 / _OTHER_UNIT <= ratio <= _OTHER_UNIT:
        return f"it is {ratio:.3g} times the derivative of the displacement, and should be 1: check its unit"
    return None
