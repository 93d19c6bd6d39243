"""From captured blocks to the run file: which samples belong to the excitation, and the attributes of the file."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from uuid import uuid4

import numpy as np

from excitation.signal import Excitation
from rigctl.disk_reserve import check_space
from rigctl.further_axes import FURTHER_AXES
from rigctl.interlocks import CHANNELS
from rigctl.runfile import Run
from rigctl.runwriter import RunWriter, part_path
from rigctl.setup import Setup
from rigctl.transport import Capability, CaptureBlock, Identity
from rigctl.waveform import Waveform

__all__ = ["Labels", "Recorder", "check_output", "file_stem", "free_path", "rig_text"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """The origin of a run, for the run file."""

    specimen: str = ""
    campaign_id: str = ""
    test_id: str = ""
    operator: str = ""
    setup: Setup = field(default_factory=Setup)

    def with_note(self, note: str) -> Labels:
        """The labels with another event for the beginning of the run; no change where it is empty."""
        notes = (*self.setup.notes, note) if note else self.setup.notes
        return replace(self, setup=replace(self.setup, notes=notes))


class Recorder:
    """Writes each sample of the excitation once, without the ramps and repetitions around it."""

    def __init__(self, path: Path, template: Run, excitation: Excitation, clock: Callable[[], float]) -> None:
        self._writer = RunWriter(path, template, expected_samples=excitation.samples, clock=clock)
        self._excitation = excitation.held()
        self._setup = setup = template.setup
        for note in (setup.tare, setup.warm_up, *setup.notes):
            if note is not None:
                self.event(str(note))

    @property
    def samples(self) -> int:
        """Samples of the excitation that are recorded."""
        return self._writer.samples

    def record(self, block: CaptureBlock, waveform: Waveform) -> CaptureBlock | None:
        """Keep the part of a block that belongs to the excitation; return it, numbered as the excitation is."""
        first = max(waveform.lead - block.first_index, 0)
        last = min(waveform.lead + waveform.samples - block.first_index, block.samples)
        if first >= last:
            return None
        values = self._setup.corrected(block.values[first:last])
        start = waveform.start + block.first_index + first - waveform.lead
        part = slice(start, start + values.shape[0])
        rows = {
            "force": values[:, 0],
            "displacement": values[:, 1],
            "displacement_command": self._excitation.displacement_m[part],
            "temperature": values[:, 3],
            "pressure": values[:, 4],
        }
        if self._excitation.current_a is not None:
            rows |= {"current": values[:, 2], "current_command": self._excitation.current_a[part]}
        rows |= dict(zip(FURTHER_AXES, values[:, len(CHANNELS) :].T, strict=False))
        self._writer.append(rows)
        return replace(block, first_index=start, values=values)

    def event(self, text: str) -> None:
        """Add an event at the time of the last sample."""
        self._writer.event(self.samples / self._excitation.sample_rate_hz, text)

    def close(self, status: str) -> Path:
        return self._writer.close(status)

    def discard(self) -> None:
        """Remove the file of a test that did not begin."""
        self._writer.discard()


def check_output(directory: Path, excitation: Excitation, identity: Identity) -> None:
    """Refuse a test whose run file cannot be written, or does not fit on the disk: RunFileError."""
    check_space(directory, excitation.samples, len(_units(excitation, identity)))


def template(excitation: Excitation, labels: Labels, identity: Identity, url: str) -> Run:
    """Make a run without samples: everything about a run that is known before it begins."""
    units = _units(excitation, identity)
    return Run(
        run_id=uuid4().hex,
        created=datetime.now(UTC).isoformat(timespec="milliseconds"),
        specimen=labels.specimen,
        sample_rate_hz=excitation.sample_rate_hz,
        period_samples=excitation.period_samples,
        excitation_kind=str(excitation.kind),
        status="truncated",
        channels={name: np.empty(0) for name in units},
        units=units,
        design=dict(excitation.design),
        test_id=labels.test_id,
        campaign_id=labels.campaign_id,
        rig=f"{rig_text(identity)} at {url}",
        operator=labels.operator,
        setup=labels.setup,
        software_version=_software_version(),
    )


def _units(excitation: Excitation, identity: Identity) -> dict[str, str]:
    """The channels of a run file and their units."""
    units = {"force": "N", "displacement": "m", "displacement_command": "m", "temperature": "degC", "pressure": "Pa"}
    if excitation.current_a is not None:
        units |= {"current": "A", "current_command": "A"}
    return units | (dict(FURTHER_AXES) if Capability.FURTHER_AXES in identity.capabilities else {})


def rig_text(identity: Identity) -> str:
    """Which rig it is, wherever it is connected."""
    return f"{identity.vendor} {identity.model} {identity.serial}"


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
