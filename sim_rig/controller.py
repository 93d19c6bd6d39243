"""The rig's controller: state machine, FIFO, interlocks and hold, counted in samples."""

from __future__ import annotations

from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rigctl.device import HYDRAULIC, Control, Fault, RigState
from rigctl.limits import Configuration, Limits, tighter
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

    def begin_run(self) -> None:
        """Start the noise of another run: it depends on the seed and the run's number only."""
        ...

    def play(self, setpoints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Play set-points, (n, 2), and return the sensor readings, (n, 5)."""
        ...

    def snapshot(self) -> object: ...

    def restore(self, snapshot: object) -> None: ...


class Controller:
    """The rig without sockets and wall clock: everything that counts in samples.

    After any fault the command decelerates within the limits to a hold set-point, without a step.
    """

    def __init__(
        self, plant: Plant, limits: Limits, *, waits: bool, at_m: float = 0.0, fifo_samples: int = FIFO_SAMPLES
    ) -> None:
        self._plant, self._machine, self._waits = plant, limits, waits
        self.state = RigState.DISABLED
        self.faults = self.first_fault = self.standing = Fault.NONE
        self.configuration = Configuration(limits=limits)
        self.fifo, self.store = SetpointFifo(capacity=fifo_samples), CaptureStore()
        self.sample_index = self.underruns = self.overruns = 0
        self.detector = 0  # that acted first, index in rigctl.device.DETECTORS
        self.history: deque[Fault] = deque(maxlen=HISTORY)  # the newest first
        self._control = Control.DISABLE
        self._setpoint, self._previous_m = np.array([at_m, 0.0]), at_m  # the command now and one sample before
        self._path: NDArray[np.float64] = np.empty(0)
        self._detectors = Detectors(limits, self.configuration.sample_rate_hz)
        self.measured: NDArray[np.float64] = plant.play(np.tile(self._setpoint, (4, 1)))[-1]

    @property
    def rate_hz(self) -> float:
        return self.configuration.sample_rate_hz

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
        if not _inside(configuration.limits, self._machine):
            raise RequestRefused("limits may only be tighter than the machine's")
        if configuration.high_water_samples > self.fifo.capacity:
            raise RequestRefused(f"high water lies above the FIFO's {self.fifo.capacity} samples")
        self.configuration = configuration
        self._plant.set_rate(configuration.sample_rate_hz)
        self._detectors = Detectors(configuration.limits, configuration.sample_rate_hz)

    def command(self, control: Control, run_id: int) -> None:
        """Obey a control word; a new run id starts a new run unless one is being played."""
        if Control.RESET in control and Control.RESET not in self._control:
            self._reset()
        self._control = control
        if run_id != self.fifo.run_id and not self.state.moving:
            self.fifo = SetpointFifo(run_id=run_id, capacity=self.fifo.capacity)
            self.store = CaptureStore(run_id=run_id)
        self._settle()

    def _reset(self) -> None:
        if not self.standing and self.at_rest:
            self.state = after_reset(self.state)
            if not self.state.faulted:
                self.faults, self.first_fault, self.detector = Fault.NONE, Fault.NONE, 0
                self._detectors = Detectors(self.configuration.limits, self.rate_hz)

    def _settle(self) -> None:
        before = self.state
        wants_start = Control.M in self._control and (self.fifo.ended or self.fifo.level >= self._prefill)
        control = self._control if wants_start or before is RigState.ACTIVE else self._control & ~Control.M
        self.state = after_command(before, control, self.at_rest)
        if self.state is RigState.ACTIVE and before is RigState.HOLD:
            if self.fifo.ended and not self.fifo.level:
                self.state = RigState.HOLD  # a repeated start of a run that has ended
            elif self.fifo.consumed == 0:
                self._plant.begin_run()
        if self.state is RigState.HOLD and before is RigState.ACTIVE:
            self._stop()
        if self.state in UNPOWERED and before not in UNPOWERED:
            self._setpoint = np.array([self._setpoint[0], 0.0])  # no current without supervision

    @property
    def _prefill(self) -> int:
        return min(self.configuration.prefill_samples, self.fifo.capacity // 2)

    def direct(self, displacement_m: float, current_a: float) -> None:
        """Travel to another hold set-point; RequestRefused unless holding, at rest and inside the limits."""
        limits = self.configuration.limits
        if self.state is not RigState.HOLD:
            raise RequestRefused(f"direct set-points have no effect in {self.state.name}")
        inside = limits.position_min_m <= displacement_m <= limits.position_max_m
        if not (inside and limits.current_min_a <= current_a <= limits.current_max_a):
            raise RequestRefused(f"direct set-point {displacement_m} m, {current_a} A lies outside the limits")
        start = float(self._path[-1]) if self._path.size else float(self._setpoint[0])
        self._path = np.concatenate([self._path, travel(start, displacement_m, limits, self.rate_hz)])
        self._setpoint = np.array([self._setpoint[0], current_a])

    def accept(self, block: SetpointBlock) -> bool:
        """Accept a block of set-points; False where it must be sent again.

        A set-point outside the limits stops the rig at once, before the motion reaches it.
        """
        known = self.fifo.consumed + self.fifo.level
        last = self.fifo.last_m
        accepted = self.fifo.accept(block)
        if self.fifo.consumed + self.fifo.level > known:
            rows = self.fifo.newest(block.samples)
            before = float(rows[0, 0]) if last is None else last
            good, fault = check_setpoints(rows, before, self.configuration.limits, self.rate_hz)
            if good < rows.shape[0]:
                self.fail(fault)
        return accepted

    def acknowledge(self, run_id: int, captured: int) -> None:
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
        was_moving = self.state is RigState.ACTIVE
        self.state = after_fault(self.state, bool(fault & HYDRAULIC))
        if self.state is RigState.FAULT_DISABLED:
            self._path = np.empty(0)
            self._setpoint = np.array([self.measured[1], 0.0])
            self._previous_m = float(self._setpoint[0])
        elif was_moving:
            self._stop()

    def set_cause(self, fault: Fault, present: bool) -> None:
        """Set or clear a cause that persists until it is removed (emergency stop, pump)."""
        self.standing = self.standing | fault if present else self.standing & ~fault
        if present:
            self.fail(fault)

    def _stop(self) -> None:
        velocity = (float(self._setpoint[0]) - self._previous_m) * self.rate_hz
        self._path = stop(float(self._setpoint[0]), velocity, self.configuration.limits, self.rate_hz)

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
        good, fault = check_setpoints(rows, float(self._setpoint[0]), self.configuration.limits, self.rate_hz)
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
        self._control &= ~Control.M
        self.state = RigState.HOLD
        self._stop()

    def _play_own(self, most: int) -> int:
        """Play the rig's own trajectory, or hold."""
        count = min(most, CHUNK, self._path.size or most)
        x = self._path[:count] if self._path.size else np.full(count, self._setpoint[0])
        rows = np.column_stack([x, np.full(count, self._setpoint[1])])
        done = int(self._play(rows).shape[0])
        self._path = self._path[done:]
        if self._path.size == 0:
            self._previous_m = float(self._setpoint[0])
            if self.state is RigState.FAULT_REACTION:
                self.state = RigState.FAULT_HOLD
            self._settle()
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
        played = np.concatenate([[self._setpoint[0]], rows[:, 0]])
        self._previous_m, self._setpoint = float(played[-2]), rows[-1].copy()
        self.measured = values[-1]
        self.sample_index += rows.shape[0]
        if trip is not None:
            self.detector = self.detector or trip.detector
            self.fail(trip.fault)
        return values


def _inside(inner: Limits, outer: Limits) -> bool:
    return tighter(inner, outer) == inner
