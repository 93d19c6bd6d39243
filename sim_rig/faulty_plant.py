"""A plant with ordered faults of machine and sensors, at an exact sample."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.device import SENSORS, PressureStage
from sim_rig.faults import OF_SENSOR, FaultKind, FaultOrder, Faults
from sim_rig.multi_axis_plant import MultiAxisPlant
from sim_rig.plant import SimulatedPlant
from sim_rig.sensors import LIVE_ZERO, RANGE

OVERHEATED_DEGC: Final = 135.0
PRESSURE_GONE_S: Final = 0.02  # time constant of the supply's decay once the pump has tripped
MACHINE: Final = (FaultKind.PUMP_TRIP, FaultKind.OVER_TEMPERATURE, FaultKind.FOLLOWING_ERROR, *sorted(OF_SENSOR))


@dataclass(frozen=True, slots=True)
class _Snapshot:
    plant: object
    elapsed_s: float | None
    last: NDArray[np.float64]
    heated: bool


class FaultyPlant:
    """Plays set-points on a plant, in pieces between the times at which faults begin."""

    def __init__(self, plant: SimulatedPlant | MultiAxisPlant, faults: Faults) -> None:
        self._plant, self._faults = plant, faults
        self._orders = faults.select(*MACHINE)
        self._rate_hz = 1000.0
        self._last: NDArray[np.float64] = np.zeros(RANGE.size)
        self._heated = False

    def set_rate(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._plant.set_rate(rate_hz)

    def set_stage(self, stage: PressureStage) -> None:
        self._plant.set_stage(stage)

    def begin_run(self) -> None:
        if self._faults.elapsed_s is None:
            self._faults.elapsed_s = 0.0
        self._plant.begin_run()

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        parts, at = [], 0
        while at < setpoints.shape[0]:
            count = min(self._until_next(), setpoints.shape[0] - at)
            parts.append(self._piece(setpoints[at : at + count]))
            at += count
        return np.concatenate(parts)

    def _until_next(self) -> int:
        """Count the samples before the next fault begins."""
        elapsed = self._faults.elapsed_s
        if elapsed is None:
            return 1 << 30
        ahead = [order.at_s - elapsed for order in self._orders if order.at_s is not None]
        return min((max(ceil(s * self._rate_hz - 1e-6), 1) for s in ahead if s > 1e-9), default=1 << 30)

    def _piece(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        active = [order for order in self._orders if self._faults.due(order)]
        self._plant.jammed = any(order.kind is FaultKind.FOLLOWING_ERROR for order in active)
        if not self._heated and any(order.kind is FaultKind.OVER_TEMPERATURE for order in active):
            self._plant.heat(OVERHEATED_DEGC)
            self._heated = True
        values = self._plant.play(setpoints)
        for order in active:
            self._spoil(order, values)
        self._last = values[-1].copy()
        if self._faults.elapsed_s is not None:
            self._faults.elapsed_s += values.shape[0] / self._rate_hz
        return values

    def _spoil(self, order: FaultOrder, values: NDArray[np.float64]) -> None:
        if order.kind is FaultKind.PUMP_TRIP:
            since = (self._faults.elapsed_s or 0.0) - (order.at_s or 0.0)
            time = since + np.arange(1, values.shape[0] + 1) / self._rate_hz
            values[:, 4] *= np.exp(-time / PRESSURE_GONE_S)
        elif order.kind in OF_SENSOR:
            channel = SENSORS.index(order.sensor)
            values[:, channel] = {
                FaultKind.SENSOR_STUCK: self._last[channel],
                FaultKind.SENSOR_SATURATED: RANGE[channel],
                FaultKind.SENSOR_BROKEN: LIVE_ZERO * RANGE[channel],
            }[order.kind]

    def snapshot(self) -> object:
        return _Snapshot(self._plant.snapshot(), self._faults.elapsed_s, self._last, self._heated)

    def restore(self, snapshot: object) -> None:
        assert isinstance(snapshot, _Snapshot)
        self._plant.restore(snapshot.plant)
        self._faults.elapsed_s, self._last, self._heated = snapshot.elapsed_s, snapshot.last, snapshot.heated
