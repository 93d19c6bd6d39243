"""The rig's own motions: a stop without a step, and travel from rest to rest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigctl.limits import Limits

MARGIN = 0.9  # of the distance left to a position limit


def stop(position_m: float, velocity_m_s: float, limits: Limits, rate_hz: float) -> NDArray[np.float64]:
    """Set-points that bring the command to rest: constant deceleration, faster where a limit is near.

    x(t) = x0 + v0·t − v0·|v0|⁻¹·a·t²/2 until t = |v0|/a, with a = max(a_limit, v0²/(2·distance)).
    """
    if velocity_m_s == 0:
        return np.array([position_m])
    end = limits.position_max_m if velocity_m_s > 0 else limits.position_min_m
    distance = max(abs(end - position_m) * MARGIN, 1e-6)
    braking = max(limits.acceleration_m_s2, velocity_m_s**2 / (2 * distance))
    duration = abs(velocity_m_s) / braking
    time = np.minimum(np.arange(1, math.ceil(duration * rate_hz) + 1) / rate_hz, duration)
    return position_m + velocity_m_s * (time - time**2 / (2 * duration))


def travel(start_m: float, end_m: float, limits: Limits, rate_hz: float) -> NDArray[np.float64]:
    """Set-points from rest to rest along the minimum-jerk curve 10 s³ − 15 s⁴ + 6 s⁵."""
    distance = abs(end_m - start_m)
    speed, acceleration = min(limits.velocity_m_s, 0.1), min(limits.acceleration_m_s2, 2.0)
    duration = max(1.875 * distance / speed, math.sqrt(5.78 * distance / acceleration), 1 / rate_hz)
    s = np.minimum(np.arange(1, math.ceil(duration * rate_hz) + 1) / (duration * rate_hz), 1.0)
    path: NDArray[np.float64] = start_m + (end_m - start_m) * s**3 * (10 - 15 * s + 6 * s**2)
    return path
