"""What every controller has: a closed loop on the plant, its own deceleration, positioning at low speed."""

from __future__ import annotations

import math
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rigctl.device import PressureStage

STEP_HZ = 1000.0  # of the loop
STROKE_M = 0.07
SPEED_M_S = 1.5
BRAKING_M_S2 = 20.0
TRAVEL_M_S = 0.05
LOW_TRAVEL_M_S = 0.01  # at low pressure
TRAVEL_M_S2 = 0.5


class Plant(Protocol):
    """Actuator, specimen and sensors."""

    def set_rate(self, rate_hz: float) -> None: ...

    def set_stage(self, stage: PressureStage) -> None: ...

    def begin_run(self) -> None: ...

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points, (n, 2), and return the sensor readings, (n, 5)."""
        ...


class Motion(Enum):
    """What the loop's set-point does."""

    REST = "rest"
    FOLLOW = "follow"
    BRAKE = "brake"
    TRAVEL = "travel"


class ServoAxis:
    """The loop at 1 kHz. Its set-point never jumps: it follows, brakes, travels or rests."""

    def __init__(self, plant: Plant) -> None:
        plant.set_rate(STEP_HZ)
        self._plant = plant
        self.motion = Motion.REST
        self.command_m, self._velocity_m_s = 0.0, 0.0
        self.current_a = 0.0
        self._target_m = 0.0
        self._travel_m_s = TRAVEL_M_S
        self._braking_m_s2 = BRAKING_M_S2
        self.measured: NDArray[np.float64] = plant.play(np.zeros((4, 2)))[-1]

    def supply(self, stage: PressureStage) -> None:
        """Choose the pressure, and the speed of positioning with it."""
        self._plant.set_stage(stage)
        self._travel_m_s = LOW_TRAVEL_M_S if stage is PressureStage.LOW else TRAVEL_M_S

    @property
    def at_rest(self) -> bool:
        return self.motion is Motion.REST

    @property
    def speed_m_s(self) -> float:
        """Of the set-point."""
        return abs(self._velocity_m_s)

    def begin_run(self) -> None:
        self._plant.begin_run()

    def brake(self, braking_m_s2: float = BRAKING_M_S2) -> None:
        """Bring the set-point to rest by a constant deceleration."""
        if self.motion is not Motion.REST:
            self.motion, self._braking_m_s2 = Motion.BRAKE, braking_m_s2

    def travel(self, target_m: float) -> None:
        """Position at low speed; only from rest."""
        if self.motion is Motion.REST:
            self.motion, self._target_m = Motion.TRAVEL, target_m

    def follow(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points, one for each step, and return the readings at each."""
        self.motion = Motion.FOLLOW
        before = self.command_m if len(points) < 2 else float(points[-2])
        self._velocity_m_s = (float(points[-1]) - before) * STEP_HZ
        return self._play(points)

    def follow_to(self, target_m: float, steps: int) -> NDArray[np.float64]:
        """Go to a set-point in a straight line over so many steps."""
        share = np.arange(1, steps + 1) / steps
        return self.follow(self.command_m + share * (target_m - self.command_m))

    def idle(self, steps: int) -> NDArray[np.float64]:
        """Advance without set-points from outside: rest, brake or travel."""
        return self._play(np.array([self._next() for _ in range(steps)]))

    def _play(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        rows = self._plant.play(np.column_stack([points, np.full(len(points), self.current_a)]))
        self.command_m, self.measured = float(points[-1]), rows[-1]
        return rows

    def _next(self) -> float:
        """Advance the set-point by one step."""
        if self.motion in (Motion.BRAKE, Motion.FOLLOW):
            less = self._braking_m_s2 / STEP_HZ
            self._velocity_m_s = math.copysign(max(abs(self._velocity_m_s) - less, 0.0), self._velocity_m_s)
            if self._velocity_m_s == 0.0:
                self.motion = Motion.REST
        elif self.motion is Motion.TRAVEL:
            self._approach()
        self.command_m += self._velocity_m_s / STEP_HZ
        return self.command_m

    def _approach(self) -> None:
        left = self._target_m - self.command_m
        if abs(left) <= abs(self._velocity_m_s) / STEP_HZ + 1e-9:
            self.command_m, self._velocity_m_s, self.motion = self._target_m, 0.0, Motion.REST
            return
        allowed = min(self._travel_m_s, math.sqrt(2 * TRAVEL_M_S2 * abs(left)))
        faster = abs(self._velocity_m_s) + TRAVEL_M_S2 / STEP_HZ
        self._velocity_m_s = math.copysign(min(allowed, faster), left)


class Switch:
    """A bit of which only the rising edge acts."""

    def __init__(self) -> None:
        self._before = False

    def rises(self, now: bool) -> bool:
        edge, self._before = now and not self._before, now
        return edge
