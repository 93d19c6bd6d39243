"""Play one test and record it: whatever happens, the rig ends safe and the file ends true."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from uuid import uuid4

import numpy as np

from excitation.plan import Test
from rigctl.address import connect
from rigctl.axis import CALL_S, Axis
from rigctl.clock import Clock, SystemClock
from rigctl.device import describe
from rigctl.errors import LimitError, RigError, RigFault, TransportError
from rigctl.interlocks import check_waveform
from rigctl.limits import Configuration, Limits, tighter
from rigctl.progress import Phase, Progress
from rigctl.runfile import Run
from rigctl.runwriter import RunWriter, part_path
from rigctl.stream import Stream, StreamPlan
from rigctl.transport import CaptureBlock, Identity, Reply, Transport
from rigctl.waveform import Waveform, with_ramps

__all__ = ["PlayerSettings", "connect", "file_stem", "play"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayerSettings:
    """Times and sizes that a laboratory may want otherwise."""

    ramp_s: float = 1.0
    limits: Limits | None = None  # tighter than the machine's
    link_patience_s: float = 2.0  # exchanges are tried again for so long
    stall_s: float = 5.0  # without any progress of the rig
    gate_s: float = 3600.0  # of the rig's time, for the temperature gate
    report_s: float = 0.1
    poll_s: float = 0.004


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """What the run file says about its origin."""

    specimen: str = ""
    campaign_id: str = ""
    test_id: str = ""
    operator: str = ""


class _Stopped(Exception):
    """The caller asked for a stop; the text is the reason."""


def play(
    transport: Transport,
    test: Test,
    out_dir: str | os.PathLike[str],
    *,
    on_progress: Callable[[Progress], None] = lambda progress: None,
    should_stop: Callable[[], str | None] = lambda: None,
    clock: Clock | None = None,
    specimen: str = "",
    campaign_id: str = "",
    test_id: str = "",
    operator: str = "",
    settings: PlayerSettings | None = None,
) -> Path:
    """Play one test and return the run file's path.

    The file's status is ``complete``, or ``aborted`` when `should_stop` gave a reason. The rig ends disabled.

    Raises
    ------
    LimitError, GateError, IdentityError
        Nothing has moved and there is no file.
    RigFault
        The rig stopped on its own: the file, in ``error.run_path``, is ``aborted``.
    TransportError
        The wire failed for good: the file is ``truncated``; the rig stops by its own watchdog.
    StopFailed
        The rig did not acknowledge the stop.
    """
    labels = Labels(specimen=specimen, campaign_id=campaign_id, test_id=test_id, operator=operator)
    player = _Player(
        transport=transport,
        test=test,
        out_dir=Path(out_dir),
        labels=labels,
        settings=settings or PlayerSettings(),
        clock=clock or SystemClock(),
        on_progress=on_progress,
        should_stop=should_stop,
    )
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
    reported_at: float = float("-inf")
    received: int = 0
    stream: Stream | None = None

    def run(self) -> Path:
        axis = Axis(self.transport, self.clock, stall_s=self.settings.stall_s)
        self._report(Phase.CONNECTING)
        identity = axis.identify()
        waveform = with_ramps(self.test.excitation, self.settings.ramp_s)
        configuration = self._configuration(identity)
        _check(self.test, waveform, configuration, identity)
        writer: RunWriter | None = None
        try:
            axis.prepare(configuration)
            self._wait(axis)
            self._report(Phase.STARTING)
            axis.enable(waveform.displacement_m[0], waveform.current_a[0])
            writer = self._writer(identity)
            self._stream(axis, waveform, configuration, identity, writer)
            axis.make_safe()
            return self._close(writer, "complete")
        except BaseException as error:  # noqa: BLE001  # whatever it is: safe first, `_end` raises it again
            return self._end(axis, waveform, writer, error)

    def _end(self, axis: Axis, waveform: Waveform, writer: RunWriter | None, error: BaseException) -> Path:
        """Make the rig safe, then the file true, then tell: after anything that went other than planned."""
        status = "truncated" if isinstance(error, TransportError) else "aborted"
        tell, self.on_progress = self.on_progress, _tell_nobody  # what is told may raise: safe comes first
        trouble = _safe_despite_interrupts(axis)
        path = None
        if writer is not None:
            if trouble is None and not isinstance(error, TransportError):
                self._drain(writer, waveform)
            seconds = writer.samples / self.test.excitation.sample_rate_hz
            writer.event(seconds, f"{status}: {str(error) or type(error).__name__}")
            path = writer.close(status)
        self.on_progress = tell
        if isinstance(error, Exception):
            self._report(Phase.STOPPED, f"{status}: {error}")
        return _outcome(self.test.name, error, trouble, path)

    def _drain(self, writer: RunWriter, waveform: Waveform) -> None:
        """Fetch what the rig captured before it stopped: the samples that show why."""
        with suppress(TransportError):
            while self.stream is not None:
                reply = self.transport.exchange(None, self.stream.plan.run_id, self.stream.captured, CALL_S)
                fresh = self.stream.take(reply)
                if fresh is None:
                    return
                self._record(writer, waveform, fresh)

    def _close(self, writer: RunWriter, status: str) -> Path:
        path = writer.close(status)
        self._report(Phase.STOPPED, status)
        return path

    def _configuration(self, identity: Identity) -> Configuration:
        limits = identity.limits
        if self.settings.limits is not None:
            limits = tighter(limits, self.settings.limits)
        return Configuration(
            sample_rate_hz=self.test.excitation.sample_rate_hz,
            prefill_samples=identity.fifo_samples // 4,
            low_water_samples=identity.fifo_samples // 4,
            high_water_samples=identity.fifo_samples * 3 // 4,
            limits=limits,
        )

    def _wait(self, axis: Axis) -> None:
        test, rate = self.test, self.test.excitation.sample_rate_hz

        def tell(text: str) -> None:
            self._stop_if_asked()
            self._report(Phase.WAITING, text)

        axis.dwell(test.dwell_s, rate, tell)
        axis.await_temperature(test.min_temperature_degc, test.max_temperature_degc, rate, self.settings.gate_s, tell)

    def _writer(self, identity: Identity) -> RunWriter:
        self.out_dir.mkdir(parents=True, exist_ok=True)
        return RunWriter(free_path(self.out_dir, self.test.name), self._template(identity), clock=self.clock.now)

    def _template(self, identity: Identity) -> Run:
        excitation = self.test.excitation
        units = {"force": "N", "displacement": "m", "displacement_command": "m", "temperature": "degC"}
        units["pressure"] = "Pa"
        if excitation.current_a is not None:
            units |= {"current": "A", "current_command": "A"}
        return Run(
            run_id=uuid4().hex,
            created=datetime.now(UTC).isoformat(timespec="milliseconds"),
            specimen=self.labels.specimen,
            sample_rate_hz=excitation.sample_rate_hz,
            period_samples=excitation.period_samples,
            excitation_kind=str(excitation.kind),
            status="truncated",
            channels={name: np.empty(0) for name in units},
            units=units,
            design=dict(excitation.design),
            test_id=self.labels.test_id or self.test.name,
            campaign_id=self.labels.campaign_id,
            rig=f"{identity.vendor} {identity.model} {identity.serial} at {self.transport.url}",
            operator=self.labels.operator,
            software_version=_software_version(),
        )

    def _stream(
        self,
        axis: Axis,
        waveform: Waveform,
        configuration: Configuration,
        identity: Identity,
        writer: RunWriter,
    ) -> None:
        self.stream = stream = Stream(
            plan=StreamPlan(
                run_id=axis.run_id,
                displacement_m=waveform.displacement_m,
                current_a=waveform.current_a,
                block_samples=self.transport.block_samples,
                fifo_samples=identity.fifo_samples,
                prefill_samples=configuration.prefill_samples,
                high_water_samples=configuration.high_water_samples,
            )
        )
        started, progress, progressed_at = False, (0, 0, 0), self.clock.now()
        while not stream.finished:
            self._stop_if_asked()
            block = stream.next_block()
            reply = axis.exchange(block, stream, self.settings.link_patience_s)
            fresh = stream.take(reply)
            if fresh is not None:
                self._record(writer, waveform, fresh)
            _raise_fault(reply)
            if not started and stream.prefilled:
                axis.activate()
                started = True
            now, reached = self.clock.now(), (stream.accepted_blocks, stream.consumed, stream.captured)
            if reached != progress:
                progress, progressed_at = reached, now
            elif now - progressed_at > self.settings.stall_s:
                raise TransportError(f"{self.transport.url}: the rig has played nothing for {self.settings.stall_s} s")
            if block is None and fresh is None:
                self.clock.sleep(self.settings.poll_s)

    def _record(self, writer: RunWriter, waveform: Waveform, block: CaptureBlock) -> None:
        first = max(waveform.lead - block.first_index, 0)
        last = min(waveform.lead + waveform.samples - block.first_index, block.samples)
        if first < last:
            values = block.values[first:last]
            start = block.first_index + first
            part = slice(start, start + values.shape[0])
            rows = {
                "force": values[:, 0],
                "displacement": values[:, 1],
                "displacement_command": waveform.displacement_m[part],
                "temperature": values[:, 3],
                "pressure": values[:, 4],
            }
            if self.test.excitation.current_a is not None:
                rows |= {"current": values[:, 2], "current_command": waveform.current_a[part]}
            writer.append(rows)
            self.received += values.shape[0]
            recorded = replace(block, first_index=start - waveform.lead, values=values)
            self._report(Phase.RUNNING, block=recorded)

    def _stop_if_asked(self) -> None:
        reason = self.should_stop()
        if reason is not None:
            raise _Stopped(reason)

    def _report(self, phase: Phase, text: str = "", block: CaptureBlock | None = None) -> None:
        now = self.clock.now()
        if phase in (Phase.RUNNING, Phase.WAITING) and now - self.reported_at < self.settings.report_s:
            return
        self.reported_at = now
        total = self.test.excitation.samples
        self.on_progress(
            Progress(
                test=self.test.name,
                phase=phase,
                samples=self.received,
                total_samples=total,
                text=text,
                block=block,
            )
        )


def _tell_nobody(progress: Progress) -> None:
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


def _raise_fault(reply: Reply) -> None:
    if reply.faults:
        raise RigFault(f"the rig stopped: {describe(reply.faults)}")


def _check(test: Test, waveform: Waveform, configuration: Configuration, identity: Identity) -> None:
    rate = configuration.sample_rate_hz
    if not identity.sample_rate_min_hz <= rate <= identity.sample_rate_max_hz:
        raise LimitError(
            f"test {test.name!r}: sample_rate is {rate:g} Hz, "
            f"the rig plays {identity.sample_rate_min_hz:g} … {identity.sample_rate_max_hz:g} Hz"
        )
    try:
        check_waveform(waveform.displacement_m, waveform.current_a, rate, configuration.limits)
    except LimitError as error:
        raise LimitError(f"test {test.name!r}: {error}") from None


def file_stem(name: str) -> str:
    """Make a file's name of a test's."""
    return re.sub(r"[^\w.+-]+", "_", name).strip("._") or "run"


def free_path(directory: Path, name: str) -> Path:
    """Name a run file after its test; where that name is taken, add -2, -3 …"""
    stem = file_stem(name)
    number = 1
    while True:
        path = directory / (f"{stem}.h5" if number == 1 else f"{stem}-{number}.h5")
        if not path.exists() and not part_path(path).exists():
            return path
        number += 1


def _software_version() -> str:
    try:
        return f"damper-rig {version('damper-rig')}"
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "damper-rig"
