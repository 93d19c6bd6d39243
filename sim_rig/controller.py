"""The rig's controller: state machine, FIFO, interlocks and hold, counted in samples."""

from __future__ import annotations

from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rigctl.device import HYDRAULIC, Control, Fault, PressureStage, RigState, describe
from rigctl.limits import JOG_S, Configuration, Limits, LowPressure, tighter
from rigctl.session import is_newer
from rigctl.setpoint_check import RESOLUTION_M, at_rest
from rigctl.transport import CaptureBlock, SetpointBlock
from sim_rig.detectors import Detectors, check_setpoints
from sim_rig.errors import RequestRefused
from sim_rig.fifo import FIFO_SAMPLES, CaptureStore, SetpointFifo
from sim_rig.states import after_command, after_fault, after_reset
from sim_rig.trajectory import stop, travel

CHUNK = 512
HISTORY = 8  # faults that the error history holds
UNPOWERED = (RigState.INIT, RigState.DISABLED, RigState.FAULT_DISABLED)


class Plant(Protocol):
    """Actuator, specimen and sensors on the sample clock."""

    def set_rate(self, rate_hz: float) -> None: ...

    def set_stage(self, stage: PressureStage) -> None:
        """Supply the actuator with low or high pressure once it has power."""
        ...

    def begin_run(self) -> None:
        """Start the noise of another run: it depends on the seed and the run's number only."""
        ...

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points, (n, 2), and return the sensor readings, (n, 5), or (n, 15) of a rig of several axes."""
        ...

    def snapshot(self) -> object: ...

    def restore(self, snapshot: object) -> None: ...


class Controller:
    """The rig without sockets and wall clock: everything that counts in samples.

    After any fault the command decelerates within the limits to a hold set-point, without a step.
    """

    def __init__(
        self,
        plant: Plant,
        limits: Limits,
        low: LowPressure,
        *,
        waits: bool,
        at_m: float = 0.0,
        fifo_samples: int = FIFO_SAMPLES,
    ) -> None:
        self._plant, self._machine, self._low, self._waits = plant, limits, low, waits
        self.state = RigState.DISABLED
        self.faults = self.first_fault = self.standing = Fault.NONE
        self.configuration = Configuration(limits=limits)
        self.fifo = SetpointFifo(capacity=fifo_samples, closed=True)
        self.sample_index = self.underruns = self.overruns = 0
        self.detector = 0  # that acted first, index in rigctl.device.DETECTORS
        self.history: deque[Fault] = deque(maxlen=HISTORY)  # the newest first
        self._off_at_rest = self._ended_cleanly = False
        self._travels = False  # the path is a travel to a direct set-point, not a stop
        self._jogs_to: float | None = None  # the path is a jog to there
        self._jog_left = 0  # samples for which the last request lasts
        self._session = 0
        self._last_run: int | None = None  # the last one that this session has opened
        self._setpoint = np.array([at_m, 0.0])
        self._before = at_rest(at_m)  # the commands up to now
        self._path: NDArray[np.float64] = np.empty(0)
        self._detectors = self._new_detectors()
        plant.set_stage(self.configuration.stage)
        self.measured: NDArray[np.float64] = plant.play(np.tile(self._setpoint, (4, 1)))[-1]
        self.store = CaptureStore(channels=self.measured.size)

    @property
    def rate_hz(self) -> float:
        return self.configuration.sample_rate_hz

    @property
    def stage(self) -> PressureStage:
        return PressureStage.OFF if self.state in UNPOWERED else self.configuration.stage

    @property
    def at_rest(self) -> bool:
        """Whether no trajectory of the rig's own is being played."""
        return self._path.size == 0

    @property
    def arrived(self) -> bool:
        return self.state is not RigState.ACTIVE and self.at_rest

    @property
    def water_marks(self) -> int:
        """Bit 0: the FIFO is below its low water mark, bit 1: above its high one."""
        level, marks = self.fifo.level, self.configuration
        return (level < marks.low_water_samples) | (level > marks.high_water_samples) << 1

    def configure(self, configuration: Configuration) -> None:
        """Apply a configuration; RequestRefused unless the rig is disabled and the machine can do it."""
        if self.state not in (RigState.INIT, RigState.DISABLED):
            raise RequestRefused(f"the configuration cannot be changed in {self.state.name}")
        low = configuration.stage is PressureStage.LOW
        if not _inside(configuration.limits, self._low.within(self._machine) if low else self._machine):
            raise RequestRefused(f"limits may only be tighter than the machine's at {configuration.stage.name}")
        if configuration.high_water_samples > self.fifo.capacity:
            raise RequestRefused(f"high water lies above the FIFO's {self.fifo.capacity} samples")
        self.configuration = configuration
        self._plant.set_rate(configuration.sample_rate_hz)
        self._plant.set_stage(configuration.stage)
        self._detectors = self._new_detectors()

    def _new_detectors(self) -> Detectors:
        return Detectors(self.configuration.limits, self.rate_hz, self.configuration.stage)

    def begin_session(self, session: int) -> None:
        """Forget the last run's number: the next host counts its runs from anywhere."""
        self._session, self._last_run = session, None

    def command(self, control: Control, run_id: int) -> None:
        """Obey a command; RequestRefused where it can have no effect in this state.

        DISABLE stops and switches the power off, HOLD stops, or closes the loop and opens a run, ACTIVATE plays it.
        """
        if Control.RESET in control:
            self._reset()
        elif control == Control.DISABLE:
            self._disable()
        elif control == Control.HOLD:
            self._hold(run_id)
        elif control == Control.ACTIVATE:
            self._activate(run_id)
        else:
            raise RequestRefused(f"control word 0b{int(control):04b} is no command")

    def _reset(self) -> None:
        """Reset a latched fault: the rig is without power afterwards."""
        if not self.state.faulted:
            return
        if self.standing:
            raise RequestRefused(f"the cause persists: {describe(self.standing)}")
        if not self.at_rest or self.state is RigState.FAULT_REACTION:
            raise RequestRefused("the rig is still coming to rest")
        self._enter(after_reset(self.state))
        self.faults, self.first_fault, self.detector = Fault.NONE, Fault.NONE, 0
        self._detectors = self._new_detectors()

    def _disable(self) -> None:
        """Discard the run, come to rest, then switch the power off.

        A repetition changes nothing: a deceleration that begins again with each one would take up to twice as long.
        """
        self.fifo.close()
        repeated, self._off_at_rest = self._off_at_rest, True
        moving = self.state is RigState.ACTIVE or not self.at_rest
        self._enter(after_command(self.state, Control.DISABLE, not moving))
        if moving and not repeated and self.state not in UNPOWERED:
            self._stop()

    def _hold(self, run_id: int) -> None:
        """Stop a motion, or open a run with a higher number."""
        if self.state is RigState.ACTIVE:
            self.fifo.close()
            self._enter(RigState.HOLD)
            self._stop()
            return
        closing = self.state is RigState.HOLD and self._off_at_rest
        if closing or self.state not in (RigState.DISABLED, RigState.HOLD):
            raise RequestRefused(f"HOLD has no effect in {self._state_text}")
        opened = self._last_run is not None and run_id == self._last_run
        if opened and self.state is RigState.HOLD:
            if self._travels:
                self._stop()
            return
        if not self.at_rest or (self._last_run is not None and not is_newer(run_id, self._last_run)):
            raise RequestRefused(
                f"run {run_id} cannot be opened in {self._state_text}: the last one is {self._last_run}"
            )
        self._last_run, self._off_at_rest = run_id, False
        self.fifo = SetpointFifo(run_id=run_id, capacity=self.fifo.capacity)
        self.store = CaptureStore(session=self._session, run_id=run_id, channels=self.measured.size)
        self._enter(after_command(self.state, Control.HOLD, at_rest=True))

    def _activate(self, run_id: int) -> None:
        """Play the open run, once."""
        if run_id == self.fifo.run_id and (self.state is RigState.ACTIVE or self._played_to_its_end):
            return  # a repetition
        ready = self.state is RigState.HOLD and self.at_rest and not self._off_at_rest and not self.fifo.closed
        if not ready or run_id != self.fifo.run_id or self.fifo.consumed:
            raise RequestRefused(f"run {run_id} cannot be played in {self._state_text}")
        if self.configuration.stage is PressureStage.LOW:
            raise RequestRefused("a run is played at high pressure only")
        if not self.fifo.ended and self.fifo.level < self._prefill:
            raise RequestRefused(f"{self.fifo.level} set-points are not enough to begin with, it takes {self._prefill}")
        self._enter(after_command(self.state, Control.ACTIVATE, self.at_rest))
        self._plant.begin_run()

    @property
    def _played_to_its_end(self) -> bool:
        return self.state is RigState.HOLD and self.fifo.closed and self.fifo.ended and self._ended_cleanly

    @property
    def _state_text(self) -> str:
        return f"{self.state.name}{', coming to rest' if not self.at_rest else ''}"

    def _enter(self, state: RigState) -> None:
        if state in UNPOWERED and self.state not in UNPOWERED:
            self._path = np.empty(0)
            self._setpoint = np.array([self._setpoint[0], 0.0])  # no current without supervision
            self._before = at_rest(float(self._setpoint[0]))
        if state is RigState.ACTIVE:
            self._ended_cleanly = False
        self.state = state

    def release_pressure(self) -> None:
        """Switch the power off in FAULT_HOLD: nobody has cared for the fault in time."""
        if self.state is RigState.FAULT_HOLD:
            self._enter(RigState.FAULT_DISABLED)

    @property
    def _prefill(self) -> int:
        return min(self.configuration.prefill_samples, self.fifo.capacity // 2)

    def direct(self, displacement_m: float, current_a: float) -> None:
        """Travel to another hold set-point; RequestRefused unless holding at high pressure and inside the limits."""
        limits = self.configuration.limits
        if self.state is not RigState.HOLD or self._off_at_rest or self.configuration.stage is PressureStage.LOW:
            raise RequestRefused(f"direct set-points have no effect in {self.state.name} at {self.stage.name}")
        inside = limits.position_min_m <= displacement_m <= limits.position_max_m
        if not (inside and limits.current_min_a <= current_a <= limits.current_max_a):
            raise RequestRefused(f"direct set-point {displacement_m} m, {current_a} A lies outside the limits")
        start = float(self._path[-1]) if self._path.size else float(self._setpoint[0])
        self._path = np.concatenate([self._path, travel(start, displacement_m, limits, self.rate_hz)])
        self._setpoint = np.array([self._setpoint[0], current_a])
        self._travels = True

    def jog(self, displacement_m: float) -> None:
        """Move towards a displacement for JOG_S, or go on for as long; RequestRefused unless holding at low pressure.

        Another displacement than the last one stops the piston first.
        """
        limits = self.configuration.limits
        if self.state is not RigState.HOLD or self._off_at_rest or self.configuration.stage is not PressureStage.LOW:
            raise RequestRefused(f"a jog has no effect in {self.state.name} at {self.stage.name}")
        if not limits.position_min_m <= displacement_m <= limits.position_max_m:
            raise RequestRefused(f"a jog to {displacement_m} m leaves the limits")
        self._jog_left = round(JOG_S * self.rate_hz)
        going = not self.at_rest and self._jogs_to == displacement_m
        if going or (self.at_rest and abs(self._setpoint[0] - displacement_m) < RESOLUTION_M):
            return
        if self._jogs_to is not None and not self.at_rest:
            self._stop()
        start = float(self._path[-1]) if self._path.size else float(self._setpoint[0])
        self._path = np.concatenate([self._path, travel(start, displacement_m, limits, self.rate_hz)])
        self._setpoint[1] = 0.0
        self._jogs_to, self._travels = displacement_m, True

    def accept(self, block: SetpointBlock) -> bool:
        """Accept a block of set-points; False where it must be sent again.

        A set-point outside the limits stops the rig at once, before the motion reaches it.
        """
        known = self.fifo.consumed + self.fifo.level
        accepted = self.fifo.accept(block)
        if self.fifo.consumed + self.fifo.level > known:
            rows = self.fifo.newest(block.samples)
            before = self.fifo.before or at_rest(float(rows[0, 0]))
            good, fault = check_setpoints(rows, before, self.configuration.limits, self.rate_hz)
            self.fifo.before = before.then(rows[:, 0])
            if good < rows.shape[0]:
                self.fail(fault)
        return accepted

    def acknowledge(self, session: int, run_id: int, captured: int) -> None:
        """Drop captured samples that the host of their run has; also after its session has ended."""
        if session == self.store.session:
            self.store.acknowledge(run_id, captured)

    def fetch(self, most: int) -> CaptureBlock:
        return self.store.fetch(most)

    def fail(self, fault: Fault) -> None:
        """Raise a fault: decelerate to hold, or switch the pressure off."""
        if fault in self.faults:
            return
        self.first_fault = self.first_fault or fault
        self.history.appendleft(fault)
        self.faults |= fault
        self.underruns += fault is Fault.UNDERFLOW
        self.overruns += fault is Fault.CAPTURE_OVERRUN
        moving = self.state is RigState.ACTIVE or not self.at_rest
        self.fifo.close()
        self._setpoint = np.array([self._setpoint[0], 0.0])  # the coil's current falls at once
        self.state = after_fault(self.state, bool(fault & HYDRAULIC))
        if self.state is RigState.FAULT_DISABLED:
            self._path = np.empty(0)
            self._setpoint = np.array([self.measured[1], 0.0])
            self._before = at_rest(float(self._setpoint[0]))
        elif moving:
            self._stop()

    def set_cause(self, fault: Fault, present: bool) -> None:
        """Set or clear a cause that persists until it is removed (emergency stop, pump)."""
        self.standing = self.standing | fault if present else self.standing & ~fault
        if present:
            self.fail(fault)

    def _stop(self) -> None:
        velocity = (float(self._setpoint[0]) - self._before.positions_m[-2]) * self.rate_hz
        self._path = stop(float(self._setpoint[0]), velocity, self.configuration.limits, self.rate_hz)
        self._travels, self._jogs_to = False, None

    def advance(self, samples: int) -> int:
        """Advance the clock by up to so many samples, fewer where it waits for the host; return how many."""
        left = samples
        while left > 0:
            done = self._play_stream(left) if self.state is RigState.ACTIVE else self._play_own(left)
            if done == 0 and self.state is RigState.ACTIVE:
                break  # waiting for the host
            left -= done
        return samples - left

    def _play_stream(self, most: int) -> int:
        """Play from the FIFO: one chunk, or none while waiting or when something ended the motion."""
        if not self.fifo.level:
            if self.fifo.ended:
                self._end_of_stream()
            elif not self._waits:
                self.fail(Fault.UNDERFLOW)
            return 0
        if not self.store.free:
            if not self._waits:
                self.fail(Fault.CAPTURE_OVERRUN)
            return 0
        rows = self.fifo.peek(min(most, CHUNK, self.store.free))
        good, fault = check_setpoints(rows, self._before, self.configuration.limits, self.rate_hz)
        if good == 0:
            self.fail(fault)
            return 0
        values = self._play(rows[:good])
        self.fifo.drop(values.shape[0])
        self.store.append(values)
        if self.state is RigState.ACTIVE and self.fifo.ended and not self.fifo.level:
            self._end_of_stream()
        return int(values.shape[0])

    def _end_of_stream(self) -> None:
        self.fifo.close()
        self._ended_cleanly = True
        self._enter(RigState.HOLD)
        self._stop()

    def _play_own(self, most: int) -> int:
        """Play the rig's own trajectory, or hold."""
        jogs = self._jogs_to is not None
        if jogs and self._jog_left == 0 and self._path.size:
            self._stop()  # nobody asks for it any more
            jogs = False
        count = min(most, CHUNK, self._path.size or most, self._jog_left if jogs and self._jog_left else most)
        x = self._path[:count] if self._path.size else np.full(count, self._setpoint[0])
        rows = np.column_stack([x, np.full(count, self._setpoint[1])])
        done = int(self._play(rows).shape[0])
        self._path = self._path[done:]
        self._jog_left = max(self._jog_left - done, 0)
        if self._path.size == 0:
            self._jogs_to = None
            self._before = at_rest(float(self._setpoint[0]))
            if self.state is RigState.FAULT_REACTION:
                self.state = RigState.FAULT_HOLD
            if self._off_at_rest and self.state not in UNPOWERED:
                self._enter(after_command(self.state, Control.DISABLE, at_rest=True))
        return done

    def _play(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points until a detector acts; return the number measured up to then."""
        before = self._plant.snapshot()
        values = self._plant.play(rows)
        trip = self._detectors.watch(values, rows[:, 0]) if self.state is not RigState.FAULT_DISABLED else None
        if trip is not None:
            self._plant.restore(before)
            rows = rows[: trip.sample + 1]
            values = self._plant.play(rows)
        self._before, self._setpoint = self._before.then(rows[:, 0]), rows[-1].copy()
        self.measured = values[-1]
        self.sample_index += rows.shape[0]
        if trip is not None:
            self.detector = self.detector or trip.detector
            self.fail(trip.fault)
        return values


def _inside(inner: Limits, outer: Limits) -> bool:
    return tighter(inner, outer) == inner
