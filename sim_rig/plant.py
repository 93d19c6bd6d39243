"""Actuator, specimen and sensors as one: set-points in, measured samples out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rigctl.device import PressureStage
from sim_rig import actuator, damper
from sim_rig.actuator import Actuator
from sim_rig.compiled import compiled
from sim_rig.parameters import Damper
from sim_rig.sensors import Noise, read
from sim_rig.skew import Skew

INNER_HZ: Final = 16e3
SUPPLY_PA: Final = 21e6
LOW_SUPPLY: Final = 0.12  # share of the supply at low pressure: 2.5 MPa, with which the actuator pushes 3.6 kN at most
JAMMED_M_S: Final = 1e-3  # piston speed that leaks through a jammed valve
# Indices in the state of this kernel.
COMMAND, SPEED, CELL, RISING_X, RISING_F, CURRENT = range(6)


@compiled
def play(
    machine: Actuator,
    specimen: Damper,
    axis: NDArray[np.float64],
    body: NDArray[np.float64],
    own: NDArray[np.float64],
    setpoints: NDArray[np.float64],
    rate_hz: float,
    fine: int,
    out: NDArray[np.float64],
    supply_pa: float,
) -> None:
    """Play set-points (n, 2); write force, displacement, current, temperature, pressure as true values at each instant.

    The controller interpolates linearly between set-points. Force and displacement pass one and the same
    anti-alias filter, a raised cosine of ±1 sample whose delay is compensated; current is held, so its
    synchronous reading is its mean from this instant to the next. Skew between channels is added later.
    """
    h = 1.0 / (rate_hz * fine)
    scratch = np.zeros(damper.RINGS)
    for k in range(setpoints.shape[0]):
        target, current = setpoints[k, 0], setpoints[k, 1]
        speed = (target - own[COMMAND]) * rate_hz
        feed = speed + machine.lead_s * (speed - own[SPEED]) * rate_hz
        falling_x = falling_f = rising_x = rising_f = mean_current = 0.0
        for j in range(fine):
            fall = 0.5 * (1.0 + math.cos(math.pi * j / fine)) / fine
            falling_x += fall * axis[actuator.X]
            falling_f += fall * own[CELL]
            rising_x += (1.0 / fine - fall) * axis[actuator.X]
            rising_f += (1.0 / fine - fall) * own[CELL]
            command = own[COMMAND] + (target - own[COMMAND]) * (j + 1) / fine
            actuator.step(machine, axis, command, feed, body[damper.FORCE], h)
            own[CURRENT] += (current - own[CURRENT]) * (1.0 - math.exp(-h / 2e-4))
            mean_current += own[CURRENT] / fine
            own[CELL] = damper.step(
                specimen, body, scratch, axis[actuator.X], axis[actuator.V], axis[actuator.A], own[CURRENT], h
            )
        out[k, 0] = own[RISING_F] + falling_f
        out[k, 1] = own[RISING_X] + falling_x
        out[k, 2] = mean_current
        out[k, 3] = body[damper.BODY]
        out[k, 4] = supply_pa * (1.0 - 0.1 * abs(axis[actuator.SPOOL]))
        own[RISING_X], own[RISING_F] = rising_x, rising_f
        own[COMMAND], own[SPEED] = target, speed


@dataclass(slots=True)
class _State:
    axis: NDArray[np.float64]
    body: NDArray[np.float64]
    own: NDArray[np.float64]
    random: np.random.Generator


@dataclass(frozen=True, slots=True)
class _Snapshot:
    axis: NDArray[np.float64]
    body: NDArray[np.float64]
    own: NDArray[np.float64]
    past: NDArray[np.float64] | None  # samples that the skewed channels have not shown yet
    random: Mapping[str, Any]  # numpy's own form of a generator's state


class SimulatedPlant:
    """One specimen in the rig. The noise of a run depends only on the seed and the run's number."""

    def __init__(
        self,
        specimen: Damper,
        noise: Noise,
        *,
        seed: int,
        start_degc: float,
        machine: Actuator | None = None,
        skew: Skew | None = None,
    ) -> None:
        self._skew = skew or Skew()
        self._specimen, self._noise, self._seed = specimen, noise, seed
        self._machine = machine or Actuator()
        self._runs = 0
        self.jammed = False  # whether the valve is stuck
        self._supply = 1.0  # share of SUPPLY_PA
        self.set_rate(1000.0)
        body = np.zeros(damper.STATE)
        body[damper.BODY], body[damper.SIGN], body[damper.TRAVEL] = start_degc, 1.0, 1.0
        self._state = _State(np.zeros(actuator.STATE), body, np.zeros(6), np.random.default_rng([seed, 0]))

    def set_rate(self, rate_hz: float) -> None:
        """Sample at another rate; the fine step stays near 1/16 ms."""
        self._skew.past = None
        self._rate_hz, self._fine = rate_hz, math.ceil(INNER_HZ / rate_hz)

    def set_stage(self, stage: PressureStage) -> None:
        """Supply low or high pressure: force falls with it, speed with its root."""
        self._supply = LOW_SUPPLY if stage is PressureStage.LOW else 1.0

    def heat(self, degc: float) -> None:
        """Set the temperature of the damper."""
        self._state.body[damper.BODY] = degc

    def begin_run(self) -> None:
        self._runs += 1
        self._state.random = np.random.default_rng([self._seed, self._runs])
        self._state.body[damper.TIME] = 0.0

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.sensed(self.true_samples(setpoints))

    def sensed(self, truth: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the sensors read of true values, (n, 5)."""
        return read(self._skew.late(truth, self._rate_hz), self._noise, self._state.random)

    def true_samples(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points, (n, 2), and return the true values at each instant, (n, 5)."""
        truth = np.empty((setpoints.shape[0], 5))
        state = self._state
        play(
            self._supplied(),
            self._specimen,
            state.axis,
            state.body,
            state.own,
            np.ascontiguousarray(setpoints),
            self._rate_hz,
            self._fine,
            truth,
            SUPPLY_PA * self._supply,
        )
        return truth

    def _supplied(self) -> Actuator:
        machine = self._machine
        speed = JAMMED_M_S if self.jammed else machine.speed_m_s * math.sqrt(self._supply)
        return machine._replace(speed_m_s=speed, stall_n=machine.stall_n * self._supply)

    def snapshot(self) -> object:
        s = self._state
        return _Snapshot(s.axis.copy(), s.body.copy(), s.own.copy(), self._skew.past, s.random.bit_generator.state)

    def restore(self, snapshot: object) -> None:
        assert isinstance(snapshot, _Snapshot)
        s = self._state
        s.axis[:], s.body[:], s.own[:] = snapshot.axis, snapshot.body, snapshot.own
        self._skew.past = snapshot.past
        s.random.bit_generator.state = snapshot.random
