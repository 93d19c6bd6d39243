"""Plays one test and records it; at the end, also after an error, the rig is stopped and the file is closed."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from excitation.plan import Test
from rigctl.address import connect
from rigctl.axis import Axis
from rigctl.clock import Clock, SystemClock
from rigctl.errors import GateError, InterlockTripped, LimitError, RigError, RigFault, TransportError
from rigctl.interlocks import Action, HoldWatch, Interlock, InterlockWatch, check_waveform
from rigctl.limits import Configuration, Limits, tighter
from rigctl.priority import real_time_priority
from rigctl.progress import Phase, Progress
from rigctl.recording import Labels, Recorder, file_stem, free_path, template
from rigctl.stream import Stream, StreamPlan
from rigctl.transport import CaptureBlock, Identity, Status, Transport
from rigctl.waveform import Waveform, with_ramps

__all__ = ["PlayerSettings", "connect", "file_stem", "play"]

PREFILL_S = 1.5  # of set-points in the FIFO before the rig starts, at most half of MOST_BUFFERED_S
MOST_BUFFERED_S = 2.5  # of set-points in the FIFO, at most three quarters of it


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayerSettings:
    """Times and limits that a laboratory may change."""

    ramp_s: float = 1.0
    settle_s: float = 0.0  # at full amplitude before recording; periodic excitations only
    limits: Limits | None = None  # tighter than the machine's
    watchdog_s: float = 1.0  # the rig stops when it has not heard from this computer for so long
    link_patience_s: float = 2.0  # an exchange is repeated for so long
    stall_s: float = 5.0  # without any progress of the rig
    gate_s: float = 3600.0  # of the rig's time, for the temperature gate and for an interlock that holds
    interlocks: tuple[Interlock, ...] = ()
    report_s: float = 0.1
    poll_s: float = 0.01

    def __post_init__(self) -> None:
        if not 0 < self.ramp_s < 3600:
            raise LimitError(f"ramp is {self.ramp_s} s: it must lie above 0 and below 3600")
        if not 0 <= self.settle_s < 3600:
            raise LimitError(f"settle is {self.settle_s} s: it must lie in 0 … 3600")
        if not 0.25 <= self.watchdog_s <= 10:
            raise LimitError(f"watchdog is {self.watchdog_s} s: it must lie in 0.25 … 10")


class _Stopped(Exception):
    """The caller asked for a stop; the text is the reason."""


def play(
    transport: Transport,
    test: Test,
    out_dir: str | os.PathLike[str],
    *,
    on_progress: Callable[[Progress], None] = lambda progress: None,
    should_stop: Callable[[], str | None] = lambda: None,
    should_hold: Callable[[], bool] = lambda: False,
    should_return: Callable[[], bool] = lambda: False,
    clock: Clock | None = None,
    specimen: str = "",
    campaign_id: str = "",
    test_id: str = "",
    operator: str = "",
    settings: PlayerSettings | None = None,
) -> Path:
    """Play one test and return the run file's path.

    The file's status is ``complete``, or ``aborted`` when `should_stop` gave a reason. The rig ends disabled.
    As long as `should_hold` says so the rig is at rest under power; then the motion is
    faded in again and continues with the first sample that is not recorded yet. Both are events in the file. Where
    `should_return` says so, a rig that was stopped travels back to mid-stroke, without current, before it is disabled.

    Raises
    ------
    LimitError, GateError, IdentityError
        Nothing has moved and there is no file; except a hold whose interlock was not released: GateError.
    InterlockTripped
        An interlock of the host ended the test: the file is ``aborted``.
    RigFault
        The rig stopped on its own: the file, in ``error.run_path``, is ``aborted``.
    TransportError
        The wire failed for good: the file is ``truncated``; the rig stops by its own watchdog.
    StopFailed
        The rig did not acknowledge the stop.
    """
    labels = Labels(specimen=specimen, campaign_id=campaign_id, test_id=test_id or test.name, operator=operator)
    player = _Player(
        transport=transport,
        test=test,
        out_dir=Path(out_dir),
        labels=labels,
        settings=settings or PlayerSettings(),
        clock=clock or SystemClock(),
        on_progress=on_progress,
        should_stop=should_stop,
        should_hold=should_hold,
        should_return=should_return,
    )
    with real_time_priority() if clock is None else nullcontext():
        return player.run()


@dataclass(slots=True, kw_only=True)
class _Player:
    transport: Transport
    test: Test
    out_dir: Path
    labels: Labels
    settings: PlayerSettings
    clock: Clock
    on_progress: Callable[[Progress], None]
    should_stop: Callable[[], str | None]
    should_hold: Callable[[], bool]
    should_return: Callable[[], bool]
    reported_at: float = float("-inf")
    stream: Stream | None = None
    waveform: Waveform | None = None
    recorder: Recorder | None = None
    holding: Interlock | None = None  # the interlock for which the test holds; None: on request

    def run(self) -> Path:
        axis = Axis(self.transport, self.clock, stall_s=self.settings.stall_s)
        self._report(Phase.CONNECTING)
        identity = axis.identify()
        configuration = self._configuration(identity)
        _check_rate(self.test, identity, configuration.sample_rate_hz)
        self.waveform = self._waveform(0, configuration.limits)
        axis.await_other_hosts()  # before the `try`: a motion of another host must not be stopped
        try:
            axis.prepare(configuration)
            self._wait(axis)
            before = HoldWatch(None, (), configuration.sample_rate_hz)
            axis.wait_at_rest(
                lambda status: self._may_go_on(status, 0, before)
            )  # a hold before the start: power stays off
            axis.confirm()
            self._report(Phase.STARTING)
            self._play_on(axis, configuration, identity)
            axis.make_safe()
            return self._close("complete")
        except BaseException as error:  # noqa: BLE001  # any error: `_end` makes the rig safe and raises it again
            return self._end(axis, error)

    def _play_on(self, axis: Axis, configuration: Configuration, identity: Identity) -> None:
        """Play to the end, through every hold."""
        watch = InterlockWatch(self.settings.interlocks, configuration.sample_rate_hz)
        while self.waveform is not None:
            axis.enable(self.waveform.displacement_m[0], self.waveform.current_a[0])
            recorder = self._recording(identity)
            self._stream(axis, self.waveform, recorder, configuration, identity, watch)
            if not self._complete:
                self._hold(axis, recorder)
            if self._complete:
                return
            self.waveform = self._waveform(recorder.samples, configuration.limits)
            watch.rearm()
            axis.number_next_run()
            self._report(Phase.RESUMING)

    @property
    def _complete(self) -> bool:
        return self.recorder is not None and self.recorder.samples == self.test.excitation.samples

    def _waveform(self, start: int, limits: Limits) -> Waveform:
        """Return the set-points still to be played; after a hold the ramp may be longer."""
        excitation, error = self.test.excitation, None
        for longer in (1, 2, 4) if start else (1,):
            waveform = with_ramps(
                excitation, longer * self.settings.ramp_s, start=start, settle_s=self.settings.settle_s
            )
            try:
                check_waveform(waveform.displacement_m, waveform.current_a, excitation.sample_rate_hz, limits)
            except LimitError as found:
                error = found
            else:
                return waveform
        raise LimitError(f"test {self.test.name!r}: {error}") from None

    def _hold(self, axis: Axis, recorder: Recorder) -> None:
        """Come to rest, keep what was played until then, and wait until the test may go on."""
        self._report(Phase.HOLDING)
        came = axis.hold()
        self._drain(axis)
        if self._complete:
            return
        recorder.event(f"hold, {self.holding}" if self.holding else "hold")
        ends = came.sample_index + round(self.settings.gate_s * self.test.excitation.sample_rate_hz)
        rest = HoldWatch(self.holding, self.settings.interlocks, self.test.excitation.sample_rate_hz)
        axis.wait_at_rest(lambda status: self._may_go_on(status, ends, rest))
        recorder.event("resumed")
        self.holding = None

    def _may_go_on(self, status: Status, ends: int, rest: HoldWatch) -> bool:
        self._stop_if_asked()
        if (stop := rest.stops(status.measured, status.sample_index)) is not None:
            raise InterlockTripped(str(stop))
        outside = not rest.over(status.measured, status.sample_index)
        if outside and status.sample_index >= ends:
            raise GateError(f"still outside after {self.settings.gate_s:g} s of holding: {self.holding}")
        if outside or self.should_hold():
            self._report(Phase.HOLD, str(self.holding or ""))
            return False
        return True

    def _end(self, axis: Axis, error: BaseException) -> Path:
        """After an error or a stop: make the rig safe, then close the file, then report."""
        status = "truncated" if isinstance(error, TransportError) else "aborted"
        tell, self.on_progress = self.on_progress, _ignore_progress  # a report may raise: the rig must be safe first
        if isinstance(error, _Stopped):
            with suppress(RigError, KeyboardInterrupt):
                axis.travel_home(self.should_return)
        trouble = _safe_despite_interrupts(axis)
        path = None
        if self.recorder is not None:
            if trouble is None and not isinstance(error, TransportError):
                with suppress(TransportError):
                    self._drain(axis)
            self.recorder.event(f"{status}: {str(error) or type(error).__name__}")
            path = self.recorder.close(status)
        self.on_progress = tell
        if isinstance(error, Exception):
            self._report(Phase.STOPPED, f"{status}: {error}")
        return _outcome(self.test.name, error, trouble, path)

    def _close(self, status: str) -> Path:
        assert self.recorder is not None
        path = self.recorder.close(status)
        self._report(Phase.STOPPED, status)
        return path

    def _drain(self, axis: Axis) -> None:
        """Fetch the samples captured until the rig was at rest: they show why it stopped."""
        while self.stream is not None:
            fresh = self.stream.take(axis.fetch(self.stream, self.settings.link_patience_s))
            if fresh is None:
                return
            self._record(fresh)

    def _configuration(self, identity: Identity) -> Configuration:
        limits = identity.limits
        if self.settings.limits is not None:
            limits = tighter(limits, self.settings.limits)
        rate, fifo = self.test.excitation.sample_rate_hz, identity.fifo_samples
        most = min(round(MOST_BUFFERED_S * rate), fifo * 3 // 4)
        return Configuration(
            sample_rate_hz=rate,
            prefill_samples=min(round(PREFILL_S * rate), most // 2),
            low_water_samples=most // 3,
            high_water_samples=most,
            heartbeat_s=self.settings.watchdog_s,
            limits=limits,
        )

    def _wait(self, axis: Axis) -> None:
        test, rate = self.test, self.test.excitation.sample_rate_hz

        def tell(text: str) -> None:
            self._stop_if_asked()
            self._report(Phase.WAITING, text)

        axis.dwell(test.dwell_s, rate, tell)
        axis.await_temperature(test.min_temperature_degc, test.max_temperature_degc, rate, self.settings.gate_s, tell)

    def _recording(self, identity: Identity) -> Recorder:
        if self.recorder is None:
            self.out_dir.mkdir(parents=True, exist_ok=True)
            run = template(self.test.excitation, self.labels, identity, self.transport.url)
            path = free_path(self.out_dir, self.test.name)
            self.recorder = Recorder(path, run, self.test.excitation, self.clock.now)
        return self.recorder

    def _stream(
        self,
        axis: Axis,
        waveform: Waveform,
        recorder: Recorder,
        configuration: Configuration,
        identity: Identity,
        watch: InterlockWatch,
    ) -> None:
        """Play a waveform to its end, or until the test has to hold."""
        self.stream = stream = Stream(
            plan=StreamPlan(
                run_id=axis.run_id,
                displacement_m=waveform.displacement_m,
                current_a=waveform.current_a,
                block_samples=min(self.transport.block_samples, max(configuration.high_water_samples // 2, 1)),
                fifo_samples=identity.fifo_samples,
                prefill_samples=configuration.prefill_samples,
                high_water_samples=configuration.high_water_samples,
            )
        )
        started, progress, progressed_at = False, (0, 0, 0), self.clock.now()
        while not stream.finished:
            self._stop_if_asked()
            if not self._complete and (self.holding is not None or self.should_hold()):
                return
            block = stream.next_block()
            reply = axis.exchange(block, stream, self.settings.link_patience_s)
            fresh = stream.take(reply)
            if fresh is not None:
                self._record(fresh)
            if reply.faults:
                raise RigFault(f"the rig stopped: {axis.fault_text(reply.faults)}")
            if fresh is not None:
                self._act_on(watch.tripped(fresh.values), recorder)
            if not started and stream.prefilled:
                axis.activate()
                started = True
            now, reached = self.clock.now(), (stream.accepted_blocks, stream.consumed, stream.captured)
            if reached != progress:
                progress, progressed_at = reached, now
            elif now - progressed_at > self.settings.stall_s:
                raise TransportError(f"{self.transport.url}: the rig has played nothing for {self.settings.stall_s} s")
            if block is None and (fresh is None or fresh.samples < self.transport.capture_samples):
                self.clock.sleep(self.settings.poll_s)

    def _act_on(self, tripped: tuple[Interlock, ...], recorder: Recorder) -> None:
        for one in tripped:
            if one.action is Action.STOP:
                raise InterlockTripped(str(one))
            recorder.event(str(one))
            if one.action is Action.HOLD:
                self.holding = one

    def _record(self, block: CaptureBlock) -> None:
        assert self.recorder is not None
        assert self.waveform is not None
        recorded = self.recorder.record(block, self.waveform)
        if recorded is not None:
            self._report(Phase.RUNNING, block=recorded)

    def _stop_if_asked(self) -> None:
        reason = self.should_stop()
        if reason is not None:
            raise _Stopped(reason)

    def _report(self, phase: Phase, text: str = "", block: CaptureBlock | None = None) -> None:
        now = self.clock.now()
        if phase in (Phase.RUNNING, Phase.WAITING, Phase.HOLD) and now - self.reported_at < self.settings.report_s:
            return
        self.reported_at = now
        self.on_progress(
            Progress(
                test=self.test.name,
                phase=phase,
                samples=0 if self.recorder is None else self.recorder.samples,
                total_samples=self.test.excitation.samples,
                text=text,
                block=block,
            )
        )


def _ignore_progress(progress: Progress) -> None:
    pass


def _safe_despite_interrupts(axis: Axis) -> RigError | None:
    """Stop the rig; a second Ctrl-C while it stops must not leave it moving. Return what failed."""
    while True:
        try:
            axis.make_safe()
        except RigError as failed:
            return failed
        except KeyboardInterrupt:
            continue
        return None


def _outcome(name: str, error: BaseException, trouble: RigError | None, path: Path | None) -> Path:
    """Return the path of a run that was stopped on request; raise everything else, the failed stop first."""
    if trouble is not None:
        trouble.run_path = path
        raise trouble from error
    if isinstance(error, _Stopped):
        if path is None:
            raise RigFault(f"test {name!r} was stopped before it began: {error}") from error
        return path
    if isinstance(error, RigError):
        error.run_path = path
    raise error


def _check_rate(test: Test, identity: Identity, rate_hz: float) -> None:
    if not identity.sample_rate_min_hz <= rate_hz <= identity.sample_rate_max_hz:
        raise LimitError(
            f"test {test.name!r}: sample_rate is {rate_hz:g} Hz, "
            f"the rig plays {identity.sample_rate_min_hz:g} … {identity.sample_rate_max_hz:g} Hz"
        )
