"""A controller that is driven by registers or signals: a PLC, a motion controller."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.clock import Clock
from rigctl.device import PressureStage
from rigctl.errors import IdentityError, LimitError
from rigctl.limits import Limits
from rigctl.machines.generator import Numbers, Shape, generated, numbers_of
from rigctl.machines.machine import Pumped, Reading
from rigctl.machines.points import Points
from rigctl.machines.rig_map import RigMap
from rigctl.machines.roles import MEASURED, STATE, Role, Way
from rigctl.machines.ways import Buffered, Driving, Generated, Streamed, TraceReader, measured_roles, row_of
from rigctl.waveform import Waveform

LIMITS: Mapping[Role, str] = {
    Role.LIMIT_POSITION_MIN: "position_min_m",
    Role.LIMIT_POSITION_MAX: "position_max_m",
    Role.LIMIT_VELOCITY: "velocity_m_s",
    Role.LIMIT_FORCE: "force_n",
}
SCANS = 2  # after which the controller has read what was written
KEPT = 1e-4  # share by which a limit may differ when it is read back: single precision and rounded counts


class RegisterMachine:
    """A machine made of values with roles."""

    def __init__(self, rig: RigMap, points: Points, clock: Clock) -> None:
        self._rig, self._points, self._clock = rig, points, clock
        self._driving = _driving(rig, points, clock)
        self._beats = 0
        extra = [Role.FAULT_CODE] if Role.FAULT_CODE in points.roles else []
        self._state = [*STATE, *extra, *measured_roles(points)]

    @property
    def url(self) -> str:
        return self._points.url

    @property
    def takes_whole(self) -> bool:
        return self._driving.takes_whole

    @property
    def drives_current(self) -> bool:
        return bool({Role.CURRENT_SETPOINT, Role.BUFFER_CURRENT} & self._points.roles)

    @property
    def unmeasured(self) -> tuple[str, ...]:
        return tuple(str(role) for role in MEASURED if role not in self._points.roles)

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        """The waveform itself, except with a function generator, which makes its own ramps."""
        if not isinstance(self._driving, Generated):
            return waveform
        if waveform.start:
            raise LimitError("a function generator begins at its first cycle: a test on hold cannot be resumed")
        assert self._rig.generator is not None
        numbers = numbers_of(excitation)
        self._driving.choose(self._written(numbers))
        return generated(numbers, self._rig.clock.rate_hz, self._rig.generator.ramp_cycles)

    def _written(self, numbers: Numbers) -> dict[Role, float]:
        generator = self._rig.generator
        assert generator is not None
        code = generator.sine if numbers.shape is Shape.SINE else generator.triangle
        if code is None:
            raise LimitError(f"the controller's generator has no {numbers.shape}: its map names none")
        written = {
            Role.GENERATOR_SHAPE: float(code),
            Role.GENERATOR_AMPLITUDE: numbers.amplitude_m,
            Role.GENERATOR_FREQUENCY: numbers.frequency_hz,
            Role.GENERATOR_CYCLES: float(numbers.cycles),
        }
        if Role.GENERATOR_RAMP_CYCLES in self._points.roles:
            written[Role.GENERATOR_RAMP_CYCLES] = float(generator.ramp_cycles)
        return written

    def configure(self, limits: Limits, stage: PressureStage, ends: float) -> None:
        wanted = {role: float(getattr(limits, name)) for role, name in LIMITS.items() if role in self._points.roles}
        if Role.LOW_PRESSURE in self._points.roles:
            wanted[Role.LOW_PRESSURE] = float(stage is PressureStage.LOW)
        if not wanted:
            return
        self._points.write(wanted, ends)
        kept = self._points.read(list(wanted), ends)
        wrong = [role for role, value in wanted.items() if abs(kept[role] - value) > KEPT * abs(value)]
        if wrong:
            raise IdentityError(f"{self.url}: the controller did not keep {', '.join(wrong)}")

    def read(self, ends: float) -> Reading:
        values = self._points.read(self._state, ends)
        code = int(values.get(Role.FAULT_CODE, 0.0))
        return Reading(
            tick=int(values[Role.TICK]),
            enabled=bool(values[Role.ENABLED]),
            running=bool(values[Role.RUNNING]),
            at_rest=bool(values[Role.AT_REST]),
            fault_code=(code or -1) if values[Role.FAULTED] else 0,
            values=row_of(values),
        )

    def beat(self, ends: float) -> None:
        self._beats = self._beats % 0x7FFF + 1
        self._points.write({Role.HOST_COUNTER: float(self._beats)}, ends)

    def enable(self, ends: float) -> None:
        self._points.write({Role.START: 0.0, Role.MOVE: 0.0, Role.STOP: 0.0, Role.ENABLE: 1.0}, ends)

    def disable(self, ends: float) -> None:
        self._points.write({Role.START: 0.0, Role.MOVE: 0.0, Role.STOP: 1.0, Role.ENABLE: 0.0}, ends)

    def stop(self, ends: float) -> None:
        self._points.write({Role.START: 0.0, Role.MOVE: 0.0, Role.STOP: 1.0}, ends)

    def reset(self, ends: float) -> None:
        """Give a rising edge, with everything else off: a reset must not start anything."""
        self.disable(ends)
        if Role.RESET in self._points.roles:
            self._points.write({Role.RESET: 1.0}, ends)
            self._await_scans(ends)
            self._points.write({Role.RESET: 0.0}, ends)

    def travel(self, displacement_m: float, current_a: float, ends: float) -> None:
        self._points.write({Role.STOP: 0.0, Role.START: 0.0, Role.MOVE: 0.0}, ends)
        values = {Role.TARGET: displacement_m}
        if Role.CURRENT_SETPOINT in self._points.roles:
            values[Role.CURRENT_SETPOINT] = current_a
        self._points.write(values, ends)
        self._await_scans(ends)  # the controller must have seen the bit low, then high
        self._points.write({Role.MOVE: 1.0}, ends)
        self._await_scans(ends)

    def _await_scans(self, ends: float) -> None:
        """Wait until the controller has certainly read what was written: its current scan may have begun before."""
        first = self._points.read([Role.TICK], ends)[Role.TICK]
        while (self._points.read([Role.TICK], ends)[Role.TICK] - first) % (1 << self._rig.clock.counter_bits) < SCANS:
            self._clock.sleep(1.0 / self._rig.clock.rate_hz)

    def start(self, queue: NDArray[np.float64], total: int, ends: float) -> None:
        self.stop(ends)  # whatever an earlier run left is void, and the start will be a rising edge
        self._await_scans(ends)
        self._driving.start(queue, total, ends)

    def pump(self, queue: NDArray[np.float64], total: int, ends: float) -> Pumped:
        return self._driving.pump(queue, total, ends)

    def close(self) -> None:
        self._points.close()


def _driving(rig: RigMap, points: Points, clock: Clock) -> Driving:
    if rig.way is Way.STREAMED:
        return Streamed(points, rig.clock, clock)
    if rig.way is Way.GENERATOR:
        return Generated(points, rig.clock, clock)
    counts = {register.role: register.count for register in rig.register}
    trace = TraceReader(points, counts[Role.TRACE_POSITION])
    return Buffered(points, counts[Role.BUFFER_WINDOW], trace, clock)
