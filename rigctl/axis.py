"""Commands to one rig, each with a deadline: enable, travel, activate, make safe."""

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

CALL_S = 0.25  # half the heartbeat's time limit: one lost answer must not exceed it
STATE_S = 5.0
CONNECT_S = 2.0
STOP_S = 3.0
POLL_S = 0.01
RIG_SILENT_S = 0.5  # the rig's heartbeat may stop for so long
SUSPECT_S = 0.25  # and so long again, over several answers: a busy computer may delay one
OTHER_HOSTS_S = (
    1.3,
    5.5,
)  # longer than the watchdog of a rig in real time; of a simulated rig that waits
UNPOWERED = (RigState.INIT, RigState.DISABLED, RigState.FAULT_DISABLED)


class Axis:
    """Commands one rig. Every wait ends with the rig's answer or at a deadline."""

    def __init__(self, transport: Transport, clock: Clock, *, stall_s: float) -> None:
        self._transport, self._clock, self._stall_s = transport, clock, stall_s
        self._last: Status | None = None
        self._beat, self._beat_at = -1, clock.now()
        self._suspected_at: float | None = None
        self.run_id = secrets.randbelow(0xFFFF) + 1  # random: blocks of an earlier host may still be in transit

    def number_next_run(self) -> None:
        """Return the next run its own number, so that the rig drops blocks of the last one."""
        self.run_id = self.run_id % 0xFFFF + 1

    def identify(self) -> Identity:
        return self._retry(lambda: self._transport.identify(CALL_S), CONNECT_S)

    def prepare(self, configuration: Configuration) -> None:
        """Clear a latched fault, disable, and give the rig its configuration."""
        status = self._command(Control.DISABLE)
        if status.faults:
            self._reset()
        self.await_state(RigState.DISABLED)
        self._command(Control.DISABLE)  # at rest by now: the rig takes over the run's number
        self._retry(lambda: self._transport.configure(configuration, CALL_S), STATE_S)

    def await_other_hosts(self) -> None:
        """Raise RigFault where another host has the rig under power: two must not command one actuator.

        Where that host has died, the rig's watchdog stops the rig as soon as nobody talks to it.
        """
        for quiet_s in OTHER_HOSTS_S:
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
        self._check_not_restarted(self.status())

    def _check_not_restarted(self, status: Status) -> None:
        if status.run_id != self.run_id:
            raise TransportError(f"{self._transport.url}: the rig was restarted: it has lost its configuration")

    def _command(self, control: Control) -> Status:
        self._last = self._retry(lambda: self._transport.command(control, self.run_id, CALL_S), STATE_S)
        return self._last

    def _reset(self) -> None:
        self._command(Control.DISABLE | Control.RESET)  # the rising edge of the bit resets
        status = self._command(Control.DISABLE)
        if status.faults:
            raise RigFault(f"the rig's fault persists after a reset: {describe(status.faults, status.detector)}")

    def enable(self, displacement_m: float, current_a: float) -> None:
        """Close the loop and travel to where the waveform begins."""
        self._command(Control.HOLD)
        self.await_state(RigState.HOLD)
        self._last = self._retry(lambda: self._transport.direct(displacement_m, current_a, CALL_S), STATE_S)
        self._poll(lambda s: s.arrived, "travel to the start of the waveform")

    def activate(self) -> None:
        """Make the rig play its FIFO."""
        self._command(Control.ACTIVATE)

    def hold(self) -> Status:
        """Bring the motion to rest within the rig's own limits; the loop stays closed."""
        self._command(Control.HOLD)
        return self._poll(lambda s: s.state is RigState.HOLD and s.arrived, "rest in HOLD")

    def travel_home(self, wanted: Callable[[], bool]) -> None:
        """Bring the motion to rest, then the piston to mid-stroke without current, as long as `wanted` says so."""
        if wanted() and self.status().state in (RigState.HOLD, RigState.ACTIVE):
            self.hold()
            self._last = self._retry(lambda: self._transport.direct(0.0, 0.0, CALL_S), STATE_S)
            self._poll(lambda s: s.arrived or not wanted(), "travel to mid-stroke")

    def wait_at_rest(self, may_go_on: Callable[[Status], bool]) -> None:
        """Keep the rig at rest, with heartbeat and supervision, until `may_go_on` says so."""
        self._wait_on_rig_clock(may_go_on, lambda s: "", lambda text: None)

    def exchange(self, block: SetpointBlock | None, stream: Stream, patience_s: float) -> Reply:
        """Exchange one block; after a lost answer ask again, from the last block that the rig is known to have."""
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
        self._check_heartbeat(reply.heartbeat)
        if reply.capture.run_id != stream.plan.run_id:
            raise TransportError(f"{self._transport.url}: the rig was restarted: it knows nothing of this run")
        return reply

    def fetch(self, stream: Stream, patience_s: float) -> Reply:
        """Fetch the next captured samples and send nothing; after a lost answer ask again."""
        run_id = stream.plan.run_id
        return self._retry(lambda: self._transport.exchange(None, run_id, stream.captured, CALL_S), patience_s)

    def _check_heartbeat(self, heartbeat: int) -> None:
        """Check the rig's heartbeat: the wire may still answer when the controller has stopped."""
        now = self._clock.now()
        if heartbeat != self._beat:
            self._beat, self._beat_at, self._suspected_at = heartbeat, now, None
        elif now - self._beat_at > RIG_SILENT_S:
            self._suspected_at = self._suspected_at or now
            if now - self._suspected_at > SUSPECT_S:
                raise TransportError(f"{self._transport.url}: the rig's heartbeat has stopped, its wire still answers")

    def await_state(self, *states: RigState) -> Status:
        """Wait until the rig is in one of the states; RigFault as soon as it reports another fault."""
        return self._poll(lambda s: s.state in states, f"state {' or '.join(s.name for s in states)}")

    def dwell(self, seconds: float, sample_rate_hz: float, tell: Callable[[str], None]) -> None:
        """Wait at rest, for a time on the rig's clock."""
        if seconds > 0:
            target = self._latest().sample_index + round(seconds * sample_rate_hz)
            self._wait_on_rig_clock(lambda s: s.sample_index >= target, lambda s: f"dwell of {seconds:g} s", tell)

    def await_temperature(
        self,
        low_degc: float | None,
        high_degc: float | None,
        sample_rate_hz: float,
        gate_s: float,
        tell: Callable[[str], None],
    ) -> None:
        """Wait until the damper is within its temperature gate; TooCold, a GateError, where waiting does not help."""
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

        self._wait_on_rig_clock(passed, lambda s: f"cooling, {s.temperature_degc:.1f} °C", tell)

    def status(self) -> Status:
        self._last = self._retry(lambda: self._transport.status(CALL_S), STATE_S)
        return self._last

    def _latest(self) -> Status:
        """Return the rig's last status: another request would advance a clock that waits for the host."""
        return self._last or self.status()

    def fault_text(self, faults: Fault) -> str:
        """Return in words why the rig stopped, with details from its status where that can be read."""
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

    def _retry(self, call: Callable[[], _T], patience_s: float) -> _T:
        """Repeat a call, which must be repeatable, until it succeeds or `patience_s` has passed."""
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

    def _wait_on_rig_clock(
        self,
        reached: Callable[[Status], bool],
        describe_wait: Callable[[Status], str],
        tell: Callable[[str], None],
    ) -> None:
        """Wait as long as the rig's clock advances."""
        status = self._latest()
        moved_at = self._clock.now()
        while not reached(status):
            tell(describe_wait(status))
            self._clock.sleep(POLL_S)
            index, status = status.sample_index, self.status()
            self._check_not_restarted(status)
            if status.faults:
                raise RigFault(f"the rig stopped: {describe(status.faults, status.detector)}")
            if status.sample_index != index:
                moved_at = self._clock.now()
            elif self._clock.now() - moved_at > self._stall_s:
                raise TransportTimeout(f"{self._transport.url}: the rig's clock has stopped")
