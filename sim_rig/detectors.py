"""The rig's own interlocks: each detector has a limit and a delay, and names the fault that it raises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.device import Fault
from rigctl.limits import Limits

DELAY_S: Mapping[Fault, float] = {
    Fault.POSITION_LIMIT: 0.0,
    Fault.VELOCITY_LIMIT: 0.005,
    Fault.FORCE_LIMIT: 0.003,
    Fault.FOLLOWING_ERROR: 0.02,
    Fault.TEMPERATURE: 0.5,
    Fault.PRESSURE: 0.01,
    Fault.SENSOR: 0.05,
}
OVERTRAVEL_M = 0.003  # measured beyond the limit of the set-points
PRESSURE_MIN_PA = 5e6


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """The first sample at which a detector acts."""

    fault: Fault
    sample: int


def check_setpoints(rows: NDArray[np.float64], previous_m: float, limits: Limits, rate_hz: float) -> tuple[int, Fault]:
    """Count the leading set-points that may be played, and name the fault of the next one."""
    x, current = rows[:, 0], rows[:, 1]
    step = np.abs(np.diff(x, prepend=previous_m))
    bad = {
        Fault.SETPOINT: ~((x >= limits.position_min_m) & (x <= limits.position_max_m)),
        Fault.POSITION_JUMP: ~(step <= limits.velocity_m_s * 1.001 / rate_hz),
        Fault.CURRENT_LIMIT: ~((current >= limits.current_min_a) & (current <= limits.current_max_a)),
    }
    good, fault = rows.shape[0], Fault.NONE
    for name, where in bad.items():
        first = int(np.argmax(where)) if where.any() else rows.shape[0]
        if first < good:
            good, fault = first, name
    return good, fault


class Detectors:
    """Watches measured samples; a violation must last for its detector's delay."""

    def __init__(self, limits: Limits, rate_hz: float) -> None:
        self._limits, self._rate_hz = limits, rate_hz
        self._lasting = dict.fromkeys(DELAY_S, 0)
        self._last_m: float | None = None

    def watch(self, values: NDArray[np.float64], setpoint_m: NDArray[np.float64]) -> Trip | None:
        """Look at samples (n, 5) with their set-points (n,); the state advances only if nothing trips."""
        trips, lasting = [], {}
        for fault, violated in self._violations(values, setpoint_m).items():
            needed = max(round(DELAY_S[fault] * self._rate_hz), 1)
            sample, lasting[fault] = first_trip(violated, self._lasting[fault], needed)
            if sample is not None:
                trips.append(Trip(fault=fault, sample=sample))
        if trips:
            return min(trips, key=lambda trip: trip.sample)
        self._lasting, self._last_m = lasting, float(values[-1, 1])
        return None

    def _violations(
        self, values: NDArray[np.float64], setpoint_m: NDArray[np.float64]
    ) -> dict[Fault, NDArray[np.bool_]]:
        limits = self._limits
        force, x, temperature, pressure = values[:, 0], values[:, 1], values[:, 3], values[:, 4]
        velocity = np.abs(np.diff(x, prepend=x[0] if self._last_m is None else self._last_m)) * self._rate_hz
        return {
            Fault.POSITION_LIMIT: (x > limits.position_max_m + OVERTRAVEL_M)
            | (x < limits.position_min_m - OVERTRAVEL_M),
            Fault.VELOCITY_LIMIT: velocity > 1.1 * limits.velocity_m_s,
            Fault.FORCE_LIMIT: np.abs(force) > limits.force_n,
            Fault.FOLLOWING_ERROR: np.abs(x - setpoint_m) > limits.following_error_m,
            Fault.TEMPERATURE: temperature > limits.temperature_max_degc,
            Fault.PRESSURE: pressure < PRESSURE_MIN_PA,
            Fault.SENSOR: np.logical_not(np.all(np.isfinite(values), axis=1)),
        }


def first_trip(violated: NDArray[np.bool_], lasting: int, needed: int) -> tuple[int | None, int]:
    """Find where a violation has lasted `needed` samples, `lasting` of them before, and how long it lasts."""
    if not violated.any():
        return None, 0
    index = np.arange(violated.size)
    since = np.maximum.accumulate(np.where(violated, -1, index))  # last sample without violation, −1 if none
    length = np.where(violated, index - since, 0) + np.where(violated & (since < 0), lasting, 0)
    reached = np.flatnonzero(length >= needed)
    return (int(reached[0]), 0) if reached.size else (None, int(length[-1]))
