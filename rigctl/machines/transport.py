"""A foreign controller behind the interface of this program's own rigs: what it lacks is kept here, on the host.

Kept here: the numbers of runs and blocks, set-points that the controller does not hold yet, captured samples until
they are acknowledged. Kept by the controller: the loop, the deceleration of a stop, its limits and its watchdog.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation
from rigctl.clock import Clock, SystemClock
from rigctl.device import Control, Fault, PressureStage, RigState
from rigctl.errors import IdentityError, RequestDenied
from rigctl.limits import JOG_S, Configuration
from rigctl.machines.machine import NO_ROWS, Machine, Pumped, Reading, RunLost
from rigctl.machines.rig_map import RigMap
from rigctl.machines.ways import fill_gap
from rigctl.session import Session
from rigctl.setpoint_check import all_bad, at_rest
from rigctl.transport import (
    HEARTBEATS,
    SEQUENCES,
    Capability,
    CaptureBlock,
    Identity,
    Reply,
    SetpointBlock,
    Status,
)
from rigctl.waveform import Waveform

HELD_SAMPLES = 1 << 22  # set-points that the host keeps for a controller
BLOCK_SAMPLES = 1024
LIMIT = "limit_"  # how the roles of limits begin
REACHED_M = 1e-4  # a jog to a place so near is over


class MachineTransport:
    """One foreign controller. Calls end by their deadline and raise only TransportError."""

    block_samples = BLOCK_SAMPLES
    capture_samples = 1  # one new sample is a reason to ask again at once

    def __init__(self, rig: RigMap, machine: Machine, *, clock: Clock | None = None) -> None:
        self._rig, self._machine, self._clock = rig, machine, clock or SystemClock()
        self.url = machine.url
        self._heartbeat = self._tick = self._ticks = 0
        self._first_fault = Fault.NONE
        self._reading: Reading | None = None
        self._powered = False  # whether this program has switched the controller on
        self._configuration = Configuration(limits=rig.limits)
        self._jogs_to, self._jog_ends = float("nan"), float("inf")  # the last request to jog, and when it ends
        self._session = Session()  # foreign controllers know no sessions: this host counts for itself
        self.interpolated = 0  # samples of this test that the controller measured and the host missed
        self._begin_run(0)

    def _begin_run(self, run_id: int) -> None:
        self._run_id, self._blocks, self._accepted = run_id, 0, 0
        self._queue: NDArray[np.float64] = np.empty((0, 2))
        self._ended = self._started = self._ran = self._told_to_stop = False
        self._consumed = self._captured = 0
        self._lost: RunLost | None = None
        self._rows: NDArray[np.float64] = NO_ROWS  # captured and not acknowledged
        self._last_row: NDArray[np.float64] = NO_ROWS

    def played_waveform(self, excitation: Excitation, waveform: Waveform) -> Waveform:
        """Return the motion that the controller will play for a test; LimitError where it cannot."""
        return self._machine.played_waveform(excitation, waveform)

    @property
    def remarks(self) -> tuple[str, ...]:
        missed = self.interpolated
        return (f"{missed} samples were missed by this computer and interpolated",) if missed else ()

    def identify(self, deadline_s: float) -> Identity:
        self._read(self._clock.now() + deadline_s)
        capabilities = Capability.SIMULATED if self._rig.simulated else Capability.NONE
        if self._machine.drives_current:
            capabilities |= Capability.CURRENT
        rate, watchdog = self._rig.clock.rate_hz, self._rig.watchdog
        return Identity(
            map_version=0,
            vendor=self._rig.make,
            model=self._rig.name,
            serial=self._rig.serial,
            channel_count=5,
            sample_rate_min_hz=rate,
            sample_rate_max_hz=rate,
            fifo_samples=HELD_SAMPLES,
            capture_samples=HELD_SAMPLES,
            capabilities=capabilities,
            limits=self._rig.limits,
            low_pressure=self._rig.low_pressure,
            unmeasured=self._machine.unmeasured,
            takes_whole=self._machine.takes_whole,
            watchdog_s=watchdog.time_s,
            takes_limits=tuple(sorted(role.removeprefix(LIMIT) for role in self._rig.roles if role.startswith(LIMIT))),
            watchdog=f"when this computer is silent for {watchdog.time_s:g} s: {watchdog.statement}",
        )

    @property
    def session(self) -> int:
        return self._session.number

    def claim(self, deadline_s: float) -> int:
        """Begin to command a controller without power; one that has power already is somebody else's."""
        reading = self._read(self._clock.now() + deadline_s)
        if not self._session.claimed:
            if reading.enabled and not reading.fault_code:
                raise RequestDenied(f"{self.url}: the controller has power already: somebody else commands it")
            self._session = Session(number=1)
        return self._session.number

    def release(self, deadline_s: float) -> None:
        if self._session.claimed and self._powered and self._read(self._clock.now() + deadline_s).enabled:
            raise RequestDenied(f"{self.url}: the controller still has power")
        self._session = Session()

    def stop(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        self._disable(self._state(self._read(ends)), self._run_id, ends)
        return self._status(self._read(ends))

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        if configuration.sample_rate_hz != self._rig.clock.rate_hz:
            raise IdentityError(
                f"{self.url}: sample_rate is {configuration.sample_rate_hz:g} Hz, "
                f"this controller's clock has {self._rig.clock.rate_hz:g} Hz"
            )
        if configuration.stage is PressureStage.LOW and self._rig.low_pressure is None:
            raise IdentityError(f"{self.url}: this controller has no low pressure: its map names none")
        self.interpolated = 0
        self._machine.configure(configuration.limits, configuration.stage, self._clock.now() + deadline_s)
        self._configuration = configuration

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        state = self._state(self._read(ends))
        if Control.RESET in control:
            self._machine.reset(ends)
        elif Control.M in control:
            self._activate(state, ends)
        elif Control.H in control:
            self._hold(state, run_id, ends)
        else:
            self._disable(state, run_id, ends)
        return self._status(self._read(ends))

    def _activate(self, state: RigState, ends: float) -> None:
        if state is RigState.ACTIVE or self._started:
            self._started = True  # a repeated start: the first one was obeyed, its answer was lost
            return
        if state is not RigState.HOLD or not len(self._queue):
            raise RequestDenied(f"{self.url}: a start needs the controller in HOLD, it is in {state.name}")
        if self._machine.takes_whole and not self._ended:
            raise RequestDenied(f"{self.url}: the test is longer than {HELD_SAMPLES // 2} samples: split it")
        self._machine.beat(ends)
        self._machine.start(self._queue, self._accepted if self._ended else 0, ends)
        self._started = True

    def _hold(self, state: RigState, run_id: int, ends: float) -> None:
        if state.faulted:
            raise RequestDenied(f"{self.url}: the controller has a fault: it must be reset first")
        if state is RigState.ACTIVE:
            self._told_to_stop = True
            self._machine.stop(ends)
            return
        if run_id != self._run_id:
            self._begin_run(run_id)
        self._machine.beat(ends)
        if state is not RigState.HOLD:
            self._machine.enable(ends)
            self._powered = True

    def _disable(self, state: RigState, run_id: int, ends: float) -> None:
        """Stop first; only what is at rest is switched off."""
        reading = self._reading
        if reading is not None and reading.enabled and not (reading.at_rest and not reading.running):
            self._told_to_stop = True
            self._machine.beat(ends)
            self._machine.stop(ends)
            return
        self._machine.disable(ends)
        self._powered = False
        if run_id != self._run_id:
            self._begin_run(run_id)

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        if self._configuration.stage is PressureStage.LOW:
            raise RequestDenied(f"{self.url}: at low pressure only a jog moves the piston")
        ends = self._clock.now() + deadline_s
        self._travel(displacement_m, current_a, ends)
        return self._status(self._read(ends))

    def _travel(self, displacement_m: float, current_a: float, ends: float) -> None:
        """Position the piston; RequestDenied, by the rule of streamed set-points, where the limits do not allow it."""
        state = self._state(self._read(ends))
        if state is not RigState.HOLD:
            raise RequestDenied(f"{self.url}: a positioning needs the controller in HOLD, it is in {state.name}")
        place, current = np.array([displacement_m]), np.array([current_a])
        bad = all_bad(place, current, at_rest(displacement_m), self._configuration.limits, self._rig.clock.rate_hz)
        if bad:
            raise RequestDenied(f"{self.url}: positioning: {bad[0]}")
        self._machine.beat(ends)
        self._machine.travel(displacement_m, current_a, ends)

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        if self._configuration.stage is not PressureStage.LOW:
            raise RequestDenied(f"{self.url}: a jog needs low pressure")
        ends = self._clock.now() + deadline_s
        reading = self._read(ends)
        if displacement_m != self._jogs_to or (reading.at_rest and abs(displacement_m - reading.values[1]) > REACHED_M):
            self._travel(displacement_m, 0.0, ends)
        self._jogs_to, self._jog_ends = displacement_m, self._clock.now() + JOG_S
        self._machine.beat(ends)
        return self._status(self._read(ends))

    def _end_jog(self, ends: float) -> None:
        """Stop a jog that nobody asks for any more; where this program dies the controller's watchdog does."""
        if self._clock.now() > self._jog_ends:
            self._jogs_to, self._jog_ends = float("nan"), float("inf")
            self._machine.stop(ends)

    def status(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        if self._powered:
            self._end_jog(ends)
            self._machine.beat(ends)
        return self._status(self._read(ends))

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        ends = self._clock.now() + deadline_s
        refused = block is not None and not self._accept(block)
        self._acknowledge(run_id, captured)
        if self._powered:
            self._machine.beat(ends)
        if self._started:
            self._pump(ends)
        reading = self._read(ends)
        self._check_running(reading, ends)
        state = self._state(reading)
        lost = self._started and self._powered and not reading.enabled and not reading.fault_code
        return Reply(
            state=state,
            faults=self._fault(reading),
            last_accepted=(self._blocks - 1) % SEQUENCES,
            fifo_free=HELD_SAMPLES - len(self._queue),
            consumed=self._consumed,
            refused=refused,
            heartbeat=self._heartbeat % HEARTBEATS,
            owned=True,
            capture=self._capture(0 if lost else self._run_id),
        )

    def close(self) -> None:
        self._machine.close()

    def _pump(self, ends: float) -> None:
        """Move set-points out and samples in; where the run is lost the controller is stopped at once."""
        if self._lost is not None:
            raise self._lost
        try:
            self._keep(self._machine.pump(self._queue, self._accepted if self._ended else 0, ends))
        except RunLost as error:
            self._lost = error
            self._machine.stop(ends)
            raise

    def _check_running(self, reading: Reading, ends: float) -> None:
        """A controller that stopped by itself, without a fault, must not be given the rest of the motion."""
        self._ran = self._ran or reading.running
        stopped = self._started and self._ran and not reading.running and not self._told_to_stop
        if stopped and reading.enabled and not reading.fault_code and len(self._queue):
            self._lost = RunLost(f"{self.url}: the controller ended the motion before its end")
            self._machine.stop(ends)
            raise self._lost

    def _accept(self, block: SetpointBlock) -> bool:
        """Put a block behind the others; one that is here already is not taken twice."""
        if block.run_id != self._run_id:
            return False
        if block.sequence != self._blocks:
            return block.sequence < self._blocks
        rows = np.column_stack([block.displacement_m, block.current_a])
        self._queue = np.concatenate([self._queue, rows])
        self._blocks, self._accepted = self._blocks + 1, self._accepted + block.samples
        self._ended = self._ended or block.end_of_stream
        return True

    def _acknowledge(self, run_id: int, captured: int) -> None:
        first = self._captured - len(self._rows)
        if run_id == self._run_id and captured > first:
            self._rows = self._rows[min(captured - first, len(self._rows)) :]

    def _keep(self, pumped: Pumped) -> None:
        """Keep what one pass brought; samples that were missed are interpolated, those behind the end dropped."""
        self._queue = self._queue[pumped.taken :]
        self._consumed += pumped.taken
        rows = pumped.rows[max(self._captured - pumped.first, 0) :]
        if not len(rows):
            return
        missing = pumped.first - self._captured
        if missing > 0 and self._captured:
            rows = np.concatenate([fill_gap(self._last_row, missing, rows[0]), rows])
            self.interpolated += missing
        elif missing > 0:
            rows = np.concatenate([np.tile(rows[0], (missing, 1)), rows])  # the run began while nobody looked
            self.interpolated += missing
        rows = rows[: max(self._consumed - self._captured, 0)]
        if len(rows):
            self._rows, self._last_row = np.concatenate([self._rows, rows]), rows[-1]
            self._captured += len(rows)

    def _capture(self, run_id: int) -> CaptureBlock:
        return CaptureBlock(run_id=run_id, first_index=self._captured - len(self._rows), values=self._rows)

    def _read(self, ends: float) -> Reading:
        reading = self._machine.read(ends)
        step = (reading.tick - self._tick) % (1 << self._rig.clock.counter_bits)
        if step and self._reading is not None:
            self._ticks += step
            self._heartbeat += 1
        self._tick, self._reading = reading.tick, reading
        return reading

    def _fault(self, reading: Reading) -> Fault:
        fault = Fault.NONE if reading.fault_code == 0 else self._rig.fault_of(reading.fault_code)
        self._first_fault = (self._first_fault or fault) if fault else Fault.NONE
        return fault

    def _state(self, reading: Reading) -> RigState:
        if reading.fault_code:
            if reading.enabled:
                return RigState.FAULT_HOLD if reading.at_rest else RigState.FAULT_REACTION
            return RigState.FAULT_DISABLED
        if not reading.enabled:
            return RigState.DISABLED
        return RigState.ACTIVE if reading.running else RigState.HOLD

    def _status(self, reading: Reading) -> Status:
        force, displacement, current, temperature, pressure = (float(value) for value in reading.values)
        faults = self._fault(reading)
        return Status(
            state=self._state(reading),
            stage=self._configuration.stage if reading.enabled else PressureStage.OFF,
            faults=faults,
            first_fault=self._first_fault,
            detector=0,
            run_id=self._run_id,
            session=self._session.number,
            heartbeat=self._heartbeat,
            fifo_level=len(self._queue),
            last_accepted=(self._blocks - 1) % SEQUENCES,
            consumed=self._consumed,
            sample_index=self._ticks,
            capture_backlog=len(self._rows),
            underruns=0,
            crc_errors=0,
            duplicates=0,
            gaps=self.interpolated,
            arrived=reading.at_rest and not reading.running,
            force_n=force,
            displacement_m=displacement,
            current_a=current,
            temperature_degc=temperature,
            pressure_pa=pressure,
        )
