"""Commands to one rig with their deadlines: enable, travel, activate, and above all make safe."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from typing import TypeVar

from rigctl.clock import Clock
from rigctl.device import Control, Fault, RigState, describe
from rigctl.errors import GateError, RequestDenied, RigFault, StopFailed, TooCold, TransportError, TransportTimeout
from rigctl.limits import Configuration
from rigctl.stream import Stream
from rigctl.transport import Identity, Reply, SetpointBlock, Status, Transport

_T = TypeVar("_T")

CALL_S = 0.25  # half the rig's heartbeat: one lost answer must not trip it
STATE_S = 5.0
CONNECT_S = 2.0
STOP_S = 3.0
POLL_S = 0.01
RIG_SILENT_S = 0.5  # the rig's heartbeat may stand still for so long
SUSPECT_S = 0.25  # and then for so long again, in every answer: a busy computer may hold one back
OTHERS_S = (1.3, 5.5)  # longer than the watchdog of a rig in real time, and of a simulated one that waits for its host
UNPOWERED = (RigState.INIT, RigState.DISABLED, RigState.FAULT_DISABLED)


class Axis:
    """One rig under command. Every wait ends: by the rig's answer or by a deadline."""

    def __init__(self, transport: Transport, clock: Clock, *, stall_s: float) -> None:
        self._transport, self._clock, self._stall_s = transport, clock, stall_s
        self._last: Status | None = None
        self._beat, self._beat_at = -1, clock.now()
        self._suspected_at: float | None = None
        self.run_id = secrets.randbelow(0xFFFF) + 1  # never the one of the run before, which may still be in flight

    def begin_another(self) -> None:
        """Number the next run: what the rig still has of the last one is void."""
        self.run_id = self.run_id % 0xFFFF + 1

    def identify(self) -> Identity:
        return self._insist(lambda: self._transport.identify(CALL_S), CONNECT_S)

    def prepare(self, configuration: Configuration) -> None:
        """Clear a latched fault, disable, and give the rig its configuration."""
        status = self._command(Control.DISABLE)
        if status.faults:
            self._reset()
        self.await_state(RigState.DISABLED)
        self._command(Control.DISABLE)  # at rest by now: it takes the number of the run
        self._insist(lambda: self._transport.configure(configuration, CALL_S), STATE_S)

    def await_others(self) -> None:
        """Raise RigFault where another host has the rig under power: two must not command one actuator.

        One that died is found out by the rig's watchdog, as soon as nobody talks to the rig.
        """
        for quiet_s in OTHERS_S:
            if self.status().state not in (RigState.HOLD, RigState.ACTIVE):
                return
            self._clock.sleep(quiet_s)
        if (state := self.status().state) in (RigState.HOLD, RigState.ACTIVE):
            raise RigFault(
                f"{self._transport.url}: another host has the rig in {state.name}: stop it there, or wait for its end"
            )

    def confirm(self) -> None:
        """Make sure that the rig is the one that was prepared, before anything moves.

        Raises TransportError where it was restarted: it has lost its configuration.
        """
        self._same(self.status())

    def _same(self, status: Status) -> None:
        if status.run_id != self.run_id:
            raise TransportError(f"{self._transport.url}: the rig was restarted: it has lost its configuration")

    def _command(self, control: Control) -> Status:
        self._last = self._insist(lambda: self._transport.command(control, self.run_id, CALL_S), STATE_S)
        return self._last

    def _reset(self) -> None:
        self._command(Control.DISABLE | Control.RESET)  # the bit's rising edge counts
        status = self._command(Control.DISABLE)
        if status.faults:
            raise RigFault(f"the rig's fault stays after a reset: {describe(status.faults, status.detector)}")

    def enable(self, displacement_m: float, current_a: float) -> None:
        """Close the loop and travel to where the waveform begins."""
        self._command(Control.HOLD)
        self.await_state(RigState.HOLD)
        self._last = self._insist(lambda: self._transport.direct(displacement_m, current_a, CALL_S), STATE_S)
        self._poll(lambda s: s.arrived, "travel to the start of the waveform")

    def activate(self) -> None:
        """Let the rig play its FIFO."""
        self._command(Control.ACTIVATE)

    def hold(self) -> Status:
        """Bring the motion to rest within the rig's own limits; the loop stays closed."""
        self._command(Control.HOLD)
        return self._poll(lambda s: s.state is RigState.HOLD and s.arrived, "rest in HOLD")

    def travel_home(self, wanted: Callable[[], bool]) -> None:
        """Bring the motion to rest, then the piston to mid-stroke without current, as long as that is wanted."""
        if wanted() and self.status().state in (RigState.HOLD, RigState.ACTIVE):
            self.hold()
            self._last = self._insist(lambda: self._transport.direct(0.0, 0.0, CALL_S), STATE_S)
            self._poll(lambda s: s.arrived or not wanted(), "travel to mid-stroke")

    def rest(self, may_go_on: Callable[[Status], bool]) -> None:
        """Keep the rig as it is, at rest, alive and watched, until it may go on."""
        self._watch(may_go_on, lambda s: "", lambda text: None)

    def exchange(self, block: SetpointBlock | None, stream: Stream, patience_s: float) -> Reply:
        """Exchange one block; a lost answer is asked for again, from what the rig is known to have."""
        ends = self._clock.now() + patience_s
        while True:
            try:
                reply = self._transport.exchange(block, stream.plan.run_id, stream.captured, CALL_S)
                break
            except TransportError:
                if self._clock.now() >= ends:
                    raise
                stream.rewind()
                block = stream.next_block()
                self._clock.sleep(POLL_S)
        self._feel(reply.heartbeat)
        if reply.capture.run_id != stream.plan.run_id:
            raise TransportError(f"{self._transport.url}: the rig was restarted: it knows nothing of this run")
        return reply

    def fetch(self, stream: Stream, patience_s: float) -> Reply:
        """Fetch the next captured samples and send nothing; a lost answer is asked for again."""
        run_id = stream.plan.run_id
        return self._insist(lambda: self._transport.exchange(None, run_id, stream.captured, CALL_S), patience_s)

    def _feel(self, heartbeat: int) -> None:
        """Watch the rig's heartbeat: a wire that answers for a controller that is dead."""
        now = self._clock.now()
        if heartbeat != self._beat:
            self._beat, self._beat_at, self._suspected_at = heartbeat, now, None
        elif now - self._beat_at > RIG_SILENT_S:
            self._suspected_at = self._suspected_at or now
            if now - self._suspected_at > SUSPECT_S:
                raise TransportError(f"{self._transport.url}: the rig's heartbeat stands still, its wire still answers")

    def await_state(self, *states: RigState) -> Status:
        """Wait until the rig is in one of the states; RigFault as soon as it reports another fault."""
        return self._poll(lambda s: s.state in states, f"state {' or '.join(s.name for s in states)}")

    def dwell(self, seconds: float, sample_rate_hz: float, tell: Callable[[str], None]) -> None:
        """Rest for so long on the rig's own clock."""
        if seconds > 0:
            target = self._latest().sample_index + round(seconds * sample_rate_hz)
            self._watch(lambda s: s.sample_index >= target, lambda s: f"dwell of {seconds:g} s", tell)

    def await_temperature(
        self,
        low_degc: float | None,
        high_degc: float | None,
        sample_rate_hz: float,
        gate_s: float,
        tell: Callable[[str], None],
    ) -> None:
        """Wait until the damper has cooled into its gate; GateError where waiting cannot help."""
        if low_degc is None and high_degc is None:
            return
        status = self._latest()
        ends = status.sample_index + round(gate_s * sample_rate_hz)

        def passed(s: Status) -> bool:
            if low_degc is not None and s.temperature_degc < low_degc:
                raise TooCold(
                    f"the damper is at {s.temperature_degc:.1f} °C, "
                    f"the test starts at {low_degc:g} °C or above: play a warm-up first"
                )
            if high_degc is None or s.temperature_degc <= high_degc:
                return True
            if s.sample_index >= ends:
                raise GateError(
                    f"the damper is at {s.temperature_degc:.1f} °C after {gate_s:g} s of waiting, "
                    f"the test starts at {high_degc:g} °C or below"
                )
            return False

        self._watch(passed, lambda s: f"cooling, {s.temperature_degc:.1f} °C", tell)

    def status(self) -> Status:
        self._last = self._insist(lambda: self._transport.status(CALL_S), STATE_S)
        return self._last

    def _latest(self) -> Status:
        """Give what the rig said last: asking again would let a clock that waits for the host go on."""
        return self._last or self.status()

    def why(self, faults: Fault) -> str:
        """Say in words why the rig stopped, with what its status adds where that can be read."""
        try:
            return describe(faults, self._transport.status(CALL_S).detector)
        except TransportError:
            return describe(faults)

    def make_safe(self) -> None:
        """Stop within the rig's own limits, then disable; the rig is safe when this returns.

        Raises
        ------
        StopFailed
            When no answer confirms it: the rig may still be powered, until its watchdog stops it.
        """
        ends = self._clock.now() + STOP_S
        last: Exception | None = None
        while self._clock.now() < ends:
            try:
                if self._stopped_and_disabled():
                    return
            except TransportError as error:
                last = error
            self._clock.sleep(POLL_S)
        raise StopFailed(
            f"{self._transport.url}: the stop was not acknowledged within {STOP_S:g} s, "
            f"the rig may still be powered ({last or 'it keeps moving'})"
        ) from last

    def _stopped_and_disabled(self) -> bool:
        state = self._transport.command(Control.DISABLE, self.run_id, CALL_S).state
        if state not in UNPOWERED:
            state = self._transport.status(CALL_S).state
        return state in UNPOWERED

    def _insist(self, call: Callable[[], _T], patience_s: float) -> _T:
        """Repeat a call that may be repeated until it succeeds or patience ends."""
        ends = self._clock.now() + patience_s
        while True:
            try:
                return call()
            except RequestDenied:
                raise
            except TransportError:
                if self._clock.now() >= ends:
                    raise
                self._clock.sleep(POLL_S)

    def _poll(self, reached: Callable[[Status], bool], what: str) -> Status:
        ends = self._clock.now() + 2 * STATE_S
        status = self._latest()
        while True:
            if status.faults:
                raise RigFault(f"the rig refuses {what}: {describe(status.faults, status.detector)}")
            if reached(status):
                return status
            if self._clock.now() >= ends:
                raise TransportTimeout(
                    f"{self._transport.url}: {what} not reached within {2 * STATE_S:g} s, "
                    f"the rig is in {status.state.name}"
                )
            self._clock.sleep(POLL_S)
            status = self.status()

    def _watch(
        self,
        reached: Callable[[Status], bool],
        describe_wait: Callable[[Status], str],
        tell: Callable[[str], None],
    ) -> None:
        """Wait on the rig's clock: no limit but that this clock must go on."""
        status = self._latest()
        moved_at = self._clock.now()
        while not reached(status):
            tell(describe_wait(status))
            self._clock.sleep(POLL_S)
            index, status = status.sample_index, self.status()
            self._same(status)
            if status.faults:
                raise RigFault(f"the rig stopped: {describe(status.faults, status.detector)}")
            if status.sample_index != index:
                moved_at = self._clock.now()
            elif self._clock.now() - moved_at > self._stall_s:
                raise TransportTimeout(f"{self._transport.url}: the rig's clock stands still")
