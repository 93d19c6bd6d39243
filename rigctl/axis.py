"""Commands to one rig, each with a deadline: enable, travel, activate, make safe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import isfinite, sqrt
from typing import TypeVar

from rigctl.clock import Clock
from rigctl.device import Control, Fault, PressureStage, RigState, describe
from rigctl.errors import (
    GateError,
    NeedsReset,
    RequestDenied,
    RigError,
    RigFault,
    RigOccupied,
    SessionLost,
    StopFailed,
    TooCold,
    TransportError,
    TransportTimeout,
)
from rigctl.limits import Configuration
from rigctl.session import NOBODY
from rigctl.stream import Stream
from rigctl.transport import Identity, Reply, SetpointBlock, Status, Transport

_T = TypeVar("_T")

CALL_S = 0.25  # half the heartbeat's time limit: one lost answer must not exceed it
STATE_S = 5.0
CONNECT_S = 2.0
STOP_S = 3.0
POLL_S = 0.01
TRAVEL_M_S = 0.1  # the fastest that a rig travels by itself, and how hard it begins
TRAVEL_M_S2 = 2.0
TRAVEL_MARGIN = 2.0  # over the time that a travel takes at the speed that the rig is allowed; and STATE_S twice
CLOCK_SAMPLES = 1 << 32  # the rig counts its samples modulo this
RIG_SILENT_S = 0.5  # the rig's heartbeat may stop for so long
SUSPECT_S = 0.25  # and so long again, over several answers: a busy computer may delay one
UNPOWERED = (RigState.INIT, RigState.DISABLED, RigState.FAULT_DISABLED)


class Axis:
    """Commands one rig. Every wait ends with the rig's answer or at a deadline."""

    def __init__(self, transport: Transport, clock: Clock, *, stall_s: float) -> None:
        self._transport, self._clock, self._stall_s = transport, clock, stall_s
        self._last: Status | None = None
        self._rig_clock = 0  # the last sample index that the rig gave to this session
        self._beat, self._beat_at = -1, clock.now()
        self._suspected_at: float | None = None
        self._configuration = Configuration()
        self._unmeasured: tuple[str, ...] = ()
        self.run_id = self._run_before = 0  # the next run, or the one that is being played; the one before

    def number_next_run(self) -> None:
        """Return the next run its own number, so that the rig drops blocks of the last one."""
        self.run_id = self.run_id % 0xFFFF + 1

    def identify(self) -> Identity:
        identity = self._retry(lambda: self._transport.identify(CALL_S), CONNECT_S)
        self._unmeasured = identity.unmeasured
        return identity

    def claim(self) -> None:
        """Become the rig's only master; nothing that was sent in an earlier session has an effect any more.

        Raises
        ------
        RigOccupied
            When another host commands the rig; it is not disturbed.
        """
        try:
            self._retry(lambda: self._transport.claim(CALL_S), CONNECT_S)
        except RequestDenied as error:
            state = self._transport.status(CALL_S).state.name
            raise RigOccupied(
                f"{self._transport.url}: another host commands the rig ({state}): stop it there, or wait for its end"
            ) from error
        self._run_before = self.status().run_id
        self.run_id = self._run_before % 0xFFFF + 1  # the rig opens a run only if its number is higher

    def release(self) -> None:
        """Give the rig up, so that another host may have it at once."""
        self._retry(lambda: self._transport.release(CALL_S), CALL_S)

    def prepare(self, configuration: Configuration) -> None:
        """Give a rig without power and without a latched fault its configuration.

        Raises
        ------
        NeedsReset
            When a fault is latched: the rig is left as it is, for an operator.
        """
        self.refuse_latched_fault()
        self._command(Control.DISABLE)
        self.await_state(RigState.DISABLED)
        self._retry(lambda: self._transport.configure(configuration, CALL_S), STATE_S)
        self._configuration = configuration

    def refuse_latched_fault(self) -> None:
        """Raise NeedsReset where the rig has latched a fault: reset is an act of an operator."""
        if (found := latched(self._transport.url, self.status())) is not None:
            raise found

    def reset(self) -> Status:
        """Reset a latched fault, as an operator has asked; RigFault where its cause persists."""
        self._command(Control.DISABLE)
        return self._command(Control.DISABLE | Control.RESET)

    def confirm(self) -> None:
        """Make sure that the rig is the one that was prepared, before anything moves: SessionLost where it is not."""
        self._check_session(self.status())

    def _check_session(self, status: Status) -> None:
        if status.session != self._transport.session:
            raise self._session_lost(status)

    def _session_lost(self, status: Status) -> RigError:
        """Say why the rig does not obey this host any more: where it was restarted its clock and its runs are gone."""
        backwards = (status.sample_index - self._rig_clock) % CLOCK_SAMPLES > CLOCK_SAMPLES // 2
        if backwards or status.run_id not in (self._run_before, self.run_id):
            return TransportError(f"{self._transport.url}: the rig was restarted: it has lost its configuration")
        return SessionLost(f"{self._transport.url}: somebody else has stopped the rig: it does not obey this host")

    def _command(self, control: Control) -> Status:
        with self._refusals():
            self._last = self._retry(lambda: self._transport.command(control, self.run_id, CALL_S), STATE_S)
        return self._last

    def _direct(self, displacement_m: float, current_a: float) -> None:
        with self._refusals():
            self._last = self._retry(lambda: self._transport.direct(displacement_m, current_a, CALL_S), STATE_S)

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        """Say why the rig refused a command: its fault, the end of this host's session, or else what it answers."""
        try:
            yield
        except RequestDenied:
            status = self.status()
            self._check_session(status)
            if status.faults:
                raise RigFault(f"the rig stopped: {describe(status.faults, status.detector)}") from None
            raise

    def enable(self, displacement_m: float, current_a: float, *, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Close the loop and travel to where the waveform begins; what `meanwhile` raises ends the travel.

        At low pressure the piston stays where it is.
        """
        self._command(Control.HOLD)
        self.await_state(RigState.HOLD)
        self._run_before = self.run_id
        if self._configuration.stage is PressureStage.LOW:
            return
        within_s = self._travel_s(displacement_m)
        self._direct(displacement_m, current_a)
        self._poll(lambda s: s.arrived, "travel to the start of the waveform", meanwhile, within_s=within_s)

    def travel(self, displacement_m: float, current_a: float) -> Status:
        """Travel to another hold set-point within the rig's own limits, and return the status at rest there."""
        within_s = self._travel_s(displacement_m)
        self._direct(displacement_m, current_a)
        return self._poll(lambda s: s.arrived, "travel", within_s=within_s)

    def jog(self, displacement_m: float, wanted: Callable[[], bool]) -> Status:
        """Move slowly at low pressure, and return the status at rest: there, or where `wanted` no longer said so.

        Each look at the rig asks for the movement once more; where this program stands still, so does the piston.
        """
        within_s = self._travel_s(displacement_m)

        def ask_again() -> None:
            if wanted():
                with self._refusals():
                    self._last = self._retry(lambda: self._transport.jog(displacement_m, CALL_S), STATE_S)

        ask_again()
        return self._poll(lambda s: s.arrived, "jog", ask_again, within_s=within_s)

    def _travel_s(self, to_m: float) -> float:
        """How long a travel may take: the rig's minimum-jerk curve at the allowed speed and acceleration."""
        limits = self._configuration.limits
        distance = abs(to_m - self._latest().displacement_m)
        if not isfinite(distance):  # of a broken sensor
            distance = limits.position_max_m - limits.position_min_m
        at_speed = 1.875 * distance / min(limits.velocity_m_s, TRAVEL_M_S)
        return max(at_speed, sqrt(5.78 * distance / min(limits.acceleration_m_s2, TRAVEL_M_S2)))

    @property
    def _rest_s(self) -> float:
        """How long the rig takes to come to rest from the largest speed within its limits."""
        return self._configuration.limits.velocity_m_s / self._configuration.limits.acceleration_m_s2

    def activate(self) -> None:
        """Make the rig play its FIFO."""
        self._command(Control.ACTIVATE)

    def hold(self, *, meanwhile: Callable[[], None] = lambda: None) -> Status:
        """Bring the motion to rest within the rig's own limits; the loop stays closed. `meanwhile` may end the wait."""
        self._command(Control.HOLD)
        resting = lambda s: s.state is RigState.HOLD and s.arrived  # noqa: E731
        return self._poll(resting, "rest in HOLD", meanwhile, within_s=self._rest_s)

    def travel_home(self, wanted: Callable[[], bool]) -> None:
        """Bring the motion to rest, then the piston to mid-stroke without current, as long as `wanted` says so."""
        if wanted() and self.status().state in (RigState.HOLD, RigState.ACTIVE):
            self.hold()
            within_s = self._travel_s(0.0)
            self._direct(0.0, 0.0)
            self._poll(lambda s: s.arrived or not wanted(), "travel to mid-stroke", within_s=within_s)

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
        if reply.owned and reply.capture.run_id == stream.plan.run_id:
            return reply
        status = self.status()
        if status.session != self._transport.session or status.run_id != stream.plan.run_id:
            raise self._session_lost(status)
        return replace(reply, owned=True, refused=True)  # a late answer, of somebody's session before this one

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
        """Wait until the damper is within its temperature gate; TooCold, a GateError, where waiting does not help.

        A reading that is missing or not finite opens no gate: GateError.
        """
        if low_degc is None and high_degc is None:
            return
        if "temperature" in self._unmeasured:
            raise GateError(f"{self._transport.url}: the rig does not measure a temperature: take the gate out")
        status = self._latest()
        ends = status.sample_index + round(gate_s * sample_rate_hz)

        def passed(s: Status) -> bool:
            if not isfinite(s.temperature_degc):
                raise GateError(
                    f"the temperature of the damper reads {s.temperature_degc} °C: its gate needs a finite reading, "
                    "look at the sensor"
                )
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
        if self._transport.session and self._last.session == self._transport.session:
            self._rig_clock = self._last.sample_index
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
        stop_s = STOP_S + TRAVEL_MARGIN * self._rest_s
        ends = self._clock.now() + stop_s
        last: Exception | None = None
        while self._clock.now() < ends:
            try:
                if self._stopped_and_disabled():
                    return
            except TransportError as error:
                last = error
            self._clock.sleep(POLL_S)
        raise StopFailed(
            f"{self._transport.url}: the stop was not acknowledged within {stop_s:.3g} s, "
            f"the rig may still be powered ({last or 'it keeps moving'})"
        ) from last

    def _stopped_and_disabled(self) -> bool:
        try:
            state = self._transport.command(Control.DISABLE, self.run_id, CALL_S).state
        except RequestDenied:  # the session is over
            status = self._transport.status(CALL_S)
            if status.session not in (NOBODY, self._transport.session):
                return True  # power never changes its master: it was off before another host could claim the rig
            state = self._transport.stop(CALL_S).state  # obeyed from anybody
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

    def _poll(
        self,
        reached: Callable[[Status], bool],
        what: str,
        meanwhile: Callable[[], None] = lambda: None,
        *,
        within_s: float = 0.0,
    ) -> Status:
        within_s = TRAVEL_MARGIN * within_s + 2 * STATE_S
        ends = self._clock.now() + within_s
        status = self._latest()
        while True:
            self._check_session(status)
            if status.faults:
                raise RigFault(f"the rig refuses {what}: {describe(status.faults, status.detector)}")
            if reached(status):
                return status
            if self._clock.now() >= ends:
                raise TransportTimeout(
                    f"{self._transport.url}: {what} not reached within {within_s:.3g} s, "
                    f"the rig is in {status.state.name}"
                )
            meanwhile()
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
            self._check_session(status)
            if status.faults:
                raise RigFault(f"the rig stopped: {describe(status.faults, status.detector)}")
            if status.sample_index != index:
                moved_at = self._clock.now()
            elif self._clock.now() - moved_at > self._stall_s:
                raise TransportTimeout(f"{self._transport.url}: the rig's clock has stopped")


def latched(url: str, status: Status) -> NeedsReset | None:
    """Return what to say where a fault is latched: it stays until an operator resets it; None where there is none."""
    if not (status.state.faulted or status.faults):
        return None
    why = describe(status.faults, status.detector)
    return NeedsReset(f"{url}: the rig is in {status.state.name}: {why}: look at it, then `damper-rig rig reset {url}`")
