"""The rig's own interlocks: each detector has a limit and a delay, and names the fault that it raises."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.device import DETECTORS as NAMES
from rigctl.device import SENSORS, Fault, PressureStage
from rigctl.interlocks import first_trip
from rigctl.limits import Limits
from rigctl.setpoint_check import RESOLUTION_M, Before, Quantity, all_bad
from sim_rig.plant import LOW_SUPPLY
from sim_rig.sensors import RANGE


@dataclass(frozen=True, slots=True, kw_only=True)
class Detector:
    """One interlock: how long a violation must last, and the fault that it raises; the fault decides on the action."""

    name: str
    fault: Fault
    delay_s: float


DETECTORS: Final = (
    *(Detector(name=f"{sensor} sensor out of range", fault=Fault.SENSOR, delay_s=0.003) for sensor in SENSORS),
    Detector(name="force sensor stuck", fault=Fault.SENSOR, delay_s=0.05),
    Detector(name="displacement sensor stuck", fault=Fault.SENSOR, delay_s=0.05),
    Detector(name="current sensor stuck", fault=Fault.SENSOR, delay_s=0.1),
    Detector(
        name="temperature sensor stuck", fault=Fault.SENSOR, delay_s=2.0
    ),  # its resolution is three times its noise
    Detector(name="position", fault=Fault.POSITION_LIMIT, delay_s=0.0),
    Detector(name="velocity", fault=Fault.VELOCITY_LIMIT, delay_s=0.005),
    Detector(name="force", fault=Fault.FORCE_LIMIT, delay_s=0.003),
    Detector(name="following error", fault=Fault.FOLLOWING_ERROR, delay_s=0.02),
    Detector(name="temperature", fault=Fault.TEMPERATURE, delay_s=0.5),
    Detector(name="supply pressure", fault=Fault.PRESSURE, delay_s=0.01),
)
OVERTRAVEL_M = 0.003  # measured position beyond the limit of the set-points
PRESSURE_MIN_PA = 5e6
FULL_SCALE = 0.999 * RANGE[:4]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """The first sample at which a detector acts."""

    fault: Fault
    detector: int  # index in rigctl.device.DETECTORS
    sample: int


_FAULTS: Final = {
    Quantity.POSITION: Fault.SETPOINT,
    Quantity.VELOCITY: Fault.POSITION_JUMP,
    Quantity.ACCELERATION: Fault.POSITION_JUMP,
    Quantity.JUMP: Fault.POSITION_JUMP,
    Quantity.CURRENT: Fault.CURRENT_LIMIT,
}


def check_setpoints(rows: NDArray[np.float64], before: Before, limits: Limits, rate_hz: float) -> tuple[int, Fault]:
    """Count the leading set-points that may be played, and return the fault of the next one."""
    found = all_bad(rows[:, 0], rows[:, 1], before, limits, rate_hz, resolution_m=RESOLUTION_M)
    if not found:
        return rows.shape[0], Fault.NONE
    first = min(found, key=lambda bad: bad.sample)
    return first.sample, _FAULTS[first.quantity]


class Detectors:
    """Checks measured samples; a violation must last for its detector's delay."""

    def __init__(self, limits: Limits, rate_hz: float, stage: PressureStage = PressureStage.HIGH) -> None:
        self._limits, self._rate_hz = limits, rate_hz
        self._pressure_min_pa = PRESSURE_MIN_PA * (LOW_SUPPLY if stage is PressureStage.LOW else 1.0)
        self._lasting = [0] * len(DETECTORS)
        self._last: NDArray[np.float64] | None = None

    def watch(self, values: NDArray[np.float64], setpoint_m: NDArray[np.float64]) -> Trip | None:
        """First trip in samples, (n, 5), with set-points, (n,); the state advances only without a trip."""
        trip, lasting = None, []
        violations = self._violations(values, setpoint_m)
        for detector, violated, before in zip(DETECTORS, violations, self._lasting, strict=True):
            needed = max(round(detector.delay_s * self._rate_hz), 1)
            sample, now = first_trip(violated, before, needed)
            lasting.append(now)
            if sample is not None and (trip is None or sample < trip.sample):
                trip = Trip(fault=detector.fault, detector=NAMES.index(detector.name), sample=sample)
        if trip is None:
            self._lasting, self._last = lasting, values[-1].copy()
        return trip

    def _violations(self, values: NDArray[np.float64], setpoint_m: NDArray[np.float64]) -> list[NDArray[np.bool_]]:
        """For each detector, the samples at which it is violated; a sensor out of range is not checked further."""
        limits = self._limits
        before = np.concatenate([values[:1] + 1.0 if self._last is None else self._last[None], values[:-1]])
        stuck = values[:, :4] == before[:, :4]
        false = ~(np.abs(values[:, :4]) < FULL_SCALE)  # the negation catches NaN too
        force, x, temperature, pressure = values[:, 0], values[:, 1], values[:, 3], values[:, 4]
        first = x[0] if self._last is None else self._last[1]
        velocity = np.abs(np.diff(x, prepend=first)) * self._rate_hz
        beyond = (x > limits.position_max_m + OVERTRAVEL_M) | (x < limits.position_min_m - OVERTRAVEL_M)
        return [
            *(false[:, k] for k in range(4)),
            *(stuck[:, k] for k in range(4)),
            beyond & ~false[:, 1],
            (velocity > 1.1 * limits.velocity_m_s) & ~false[:, 1],
            (np.abs(force) > limits.force_n) & ~false[:, 0],
            (np.abs(x - setpoint_m) > limits.following_error_m) & ~false[:, 1],
            (temperature > limits.temperature_max_degc) & ~false[:, 3],
            pressure < self._pressure_min_pa,
        ]
