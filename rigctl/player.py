"""Plays one test and records it; at the end, also after an error, the rig is stopped and the file is closed."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path

from excitation.plan import Test
from rigctl.address import connect
from rigctl.axis import Axis
from rigctl.clock import Clock, SystemClock
from rigctl.errors import GateError, InterlockTripped, LimitError, RigError, RigFault, RunFileError, TransportError
from rigctl.interlocks import Action, HoldWatch, Interlock, InterlockWatch, check_measured, check_waveform
from rigctl.limit_watch import LimitWatch
from rigctl.limits import Configuration, Limits
from rigctl.limits_together import check_envelopes
from rigctl.player_settings import PlayerSettings
from rigctl.priority import streaming_priority
from rigctl.progress import Phase, Progress, joined
from rigctl.recording import Labels, Recorder, check_output, file_stem, free_path, template
from rigctl.run_configuration import run_configuration
from rigctl.setup import Setup
from rigctl.stream import Stream, StreamPlan
from rigctl.transport import Capability, CaptureBlock, Identity, OwnMotion, Status, Transport
from rigctl.waveform import Waveform, with_ramps
from rigctl.wire_rate import check_wire

__all__ = ["PlayerSettings", "connect", "file_stem", "play"]


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
    setup: Setup | None = None,
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
    labels = Labels(
        specimen=specimen,
        campaign_id=campaign_id,
        test_id=test_id or test.name,
        operator=operator,
        setup=setup or Setup(),
    )
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
    with streaming_priority() if clock is None else nullcontext("") as permitted:
        player.labels = player.labels.with_note(permitted)
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
    unreported: list[CaptureBlock] = field(default_factory=list)
    fifo: float | None = None
    stream: Stream | None = None
    waveform: Waveform | None = None
    recorder: Recorder | None = None
    holding: Interlock | None = None  # the interlock for which the test holds; None: on request

    def run(self) -> Path:
        axis = Axis(self.transport, self.clock, stall_s=self.settings.stall_s)
        self._report(Phase.CONNECTING)
        identity = axis.identify()
        self.labels = self.labels.with_note(identity.watchdog)
        configuration = run_configuration(self.test, identity, self.settings)
        check_envelopes(self.test, self.settings.envelopes)
        further_axes = Capability.FURTHER_AXES in identity.capabilities
        check_measured(self.settings.interlocks, identity.unmeasured, further_axes=further_axes)
        check_output(self.out_dir, self.test.excitation, identity)  # at once, and not after a wait of an hour
        self.waveform = self._waveform(0, configuration.limits)
        axis.claim()
        try:
            return self._play_as_master(axis, configuration, identity)
        finally:
            with suppress(RigError):  # else the rig ends the session itself, once this host is silent
                axis.release()

    def _play_as_master(self, axis: Axis, configuration: Configuration, identity: Identity) -> Path:
        try:
            axis.prepare(configuration)
            check_wire(self.transport, self.clock, identity, configuration.sample_rate_hz)
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
            recorder = self._recording(identity)  # before the pump is asked for
            start = (self.waveform.displacement_m[0], self.waveform.current_a[0])
            axis.enable(*start, meanwhile=self._stop_if_asked)
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
            if isinstance(self.transport, OwnMotion):
                waveform = self.transport.played_waveform(excitation, waveform)
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
        came = axis.hold(meanwhile=self._stop_if_asked)
        self._drain(axis, meanwhile=self._stop_if_asked)
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
                with suppress(TransportError, RunFileError):
                    self._drain(axis)
            path = self._close_after(error, status)
        self.on_progress = tell
        if isinstance(error, Exception):
            self._report(Phase.STOPPED, f"{status}: {error}")
        return _outcome(self.test.name, error, trouble, path)

    def _close_after(self, error: BaseException, status: str) -> Path | None:
        """Close the file after an error or a stop; None where the test had not begun, or the disk is full for good."""
        assert self.recorder is not None
        if self.stream is None:
            self.recorder.discard()
            return None
        with suppress(RunFileError):
            self.recorder.event(f"{status}: {str(error) or type(error).__name__}")
        try:
            self._remark(self.recorder)
            return self.recorder.close(status)
        except RunFileError as closing:
            if not isinstance(error, RigError):
                raise
            error.args = (f"{error}; {closing}",)
            return None

    def _close(self, status: str) -> Path:
        assert self.recorder is not None
        self._remark(self.recorder)
        path = self.recorder.close(status)
        self._report(Phase.STOPPED, status)
        return path

    def _remark(self, recorder: Recorder) -> None:
        """Write down what a controller of another make has to say of the test."""
        if isinstance(self.transport, OwnMotion):
            for text in self.transport.remarks:
                recorder.event(text)

    def _drain(self, axis: Axis, *, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Fetch the samples captured until the rig was at rest: they show why it stopped."""
        while self.stream is not None:
            meanwhile()
            fresh = self.stream.take(axis.fetch(self.stream, self.settings.link_patience_s))
            if fresh is None:
                return
            self._record(fresh)

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
        limits = LimitWatch(configuration.limits, configuration.sample_rate_hz)
        started, progress, progressed_at = False, (0, 0, 0), self.clock.now()
        while not stream.finished:
            self._stop_if_asked()
            if not self._complete and (self.holding is not None or self.should_hold()):
                return
            block = stream.next_block()
            reply = axis.exchange(block, stream, self.settings.link_patience_s)
            fresh = stream.take(reply)
            self.fifo = 1.0 - reply.fifo_free / identity.fifo_samples
            if fresh is not None:
                self._record(fresh)
                self._check_limits(fresh, limits)
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

    def _check_limits(self, block: CaptureBlock, limits: LimitWatch) -> None:
        assert self.waveform is not None
        command = self.waveform.displacement_m[block.first_index : block.first_index + block.samples]
        if (exceeded := limits.exceeded(block.values, command)) is not None:
            raise InterlockTripped(exceeded)

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
            self.unreported.append(recorded)
            self._report(Phase.RUNNING)

    def _stop_if_asked(self) -> None:
        reason = self.should_stop()
        if reason is not None:
            raise _Stopped(reason)

    def _report(self, phase: Phase, text: str = "") -> None:
        now = self.clock.now()
        if phase in (Phase.RUNNING, Phase.WAITING, Phase.HOLD) and now - self.reported_at < self.settings.report_s:
            return
        self.reported_at = now
        block, self.unreported = joined(self.unreported), []
        self.on_progress(
            Progress(
                test=self.test.name,
                phase=phase,
                samples=0 if self.recorder is None else self.recorder.samples,
                total_samples=self.test.excitation.samples,
                text=text,
                block=block,
                sample_rate_hz=self.test.excitation.sample_rate_hz,
                fifo=self.fifo,
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
