"""The run file: one captured test in HDF5, read and written whole."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import written_whole
from excitation.kinds import Kind
from excitation.untrusted import DAMAGE, Limits, open_hdf5, parse_json
from rigctl.errors import RunFileError
from rigctl.further_axes import FURTHER_AXES
from rigctl.not_a_run import not_a_run
from rigctl.setup import Setup, get_setup, put_setup

FORMAT = "damper-rig/run"
FORMAT_VERSION = 1
STATUSES = ("complete", "aborted", "truncated")
EVENT_BYTES = 240
UTC_BYTES = 32  # an ISO 8601 time stamp

# The unit that the contract gives a channel; any other channel may carry any of UNITS.
CHANNEL_UNITS: Mapping[str, tuple[str, ...]] = {
    "displacement": ("m",),
    "force": ("N",),
    "current": ("A",),
    "temperature": ("degC",),
    "displacement_command": ("m",),
    "current_command": ("A",),
    "velocity": ("m/s",),
    "acceleration": ("m/s²",),
    "force_simulated": ("N",),
    "pressure": ("Pa",),
    **{name: (unit,) for name, unit in FURTHER_AXES.items()},
}
UNITS = (
    "m",
    "rad",
    "m/s",
    "rad/s",
    "m/s²",
    "rad/s²",
    "N",
    "N·m",
    "A",
    "V",
    "W",
    "Pa",
    "degC",
    "K",
    "Hz",
    "s",
    "1",
)
# Other spellings of the same unit that programs without a Unicode keyboard write.
UNIT_SPELLINGS = {
    "m/s^2": "m/s²",
    "rad/s^2": "rad/s²",
    "N*m": "N·m",
    "N m": "N·m",
    "Nm": "N·m",
    "°C": "degC",
    "": "1",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One captured test: what was commanded, what was measured, and how it ended.

    Every channel is a float64 array of the same length on one uniform time base; sample 0 is the first sample
    of the excitation. Raises RunFileError when a channel is of another length, has a sample that is not
    finite, or has no known unit.
    """

    run_id: str
    created: str  # ISO 8601, UTC
    specimen: str
    sample_rate_hz: float
    period_samples: int  # 0 where the run is not periodic
    excitation_kind: str
    status: str
    channels: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]
    design: Mapping[str, Any] | None = None  # any JSON object: the configuration that makes the excitation again
    events: tuple[tuple[float, str], ...] = ()  # (seconds from sample 0, text)
    events_utc: tuple[str, ...] = ()  # time of each event, ISO 8601; empty where the file has none
    setup: Setup = field(default_factory=Setup)
    test_id: str = ""
    campaign_id: str = ""
    rig: str = ""
    operator: str = ""
    software_version: str = ""
    imported: Mapping[str, Any] | None = None  # JSON: the file of another program and what was chosen of it
    path: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        _check_header(self)
        length = self.samples
        for name, values in self.channels.items():
            _check_channel(name, values, length, self.units.get(name))

    @property
    def samples(self) -> int:
        """Length of every channel."""
        return next((int(np.size(values)) for values in self.channels.values()), 0)


def _check_header(run: Run) -> None:
    if not run.run_id:
        raise RunFileError("run_id is empty: every run needs a unique name")
    if not (isfinite(run.sample_rate_hz) and run.sample_rate_hz > 0):
        raise RunFileError(f"sample_rate is {run.sample_rate_hz}: it must be positive and finite, Hz")
    if run.period_samples < 0:
        raise RunFileError(f"period_samples is {run.period_samples}: it must be 0 (not periodic) or more")
    if run.excitation_kind not in tuple(Kind):
        raise RunFileError(f"excitation_kind is {run.excitation_kind!r:.60}: it must be one of {', '.join(Kind)}")
    if run.status not in STATUSES:
        raise RunFileError(f"status is {run.status!r:.60}: it must be one of {', '.join(STATUSES)}")
    if not run.channels:
        raise RunFileError("no channel: a run holds at least one")
    try:
        datetime.fromisoformat(run.created)
    except ValueError as error:
        raise RunFileError(f"created is {run.created!r:.60}: it must be a date and time in ISO 8601, UTC") from error


def _check_channel(name: str, values: NDArray[np.float64], length: int, unit: str | None) -> None:
    allowed = CHANNEL_UNITS.get(name, UNITS)
    if unit is None:
        raise RunFileError(f"channel {name}: unit is missing, it must be {' or '.join(allowed)}")
    if unit not in allowed:
        raise RunFileError(f"channel {name}: unit {unit!r:.60} is unknown here, it must be {' or '.join(allowed)}")
    if values.ndim != 1 or values.dtype != np.float64:
        raise RunFileError(f"channel {name}: shape {values.shape} of {values.dtype}, it must be a 1-D array of float64")
    if values.size != length:
        first = min(values.size, length)
        raise RunFileError(f"channel {name}: {values.size} samples where {length} are due, first bad sample {first}")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise RunFileError(
            f"channel {name}: sample {bad[0]} is {values[bad[0]]} ({bad.size} bad in all), it must be finite"
        )


def read_run(path: str | os.PathLike[str], *, limits: Limits | None = None) -> Run:
    """Read one run file and check all of it; ``limits`` are what it may hold.

    Returns
    -------
    run : Run
        Channels float64, SI units, in the order of their names.

    Raises
    ------
    RunFileError
        One line that names the file, and where it applies the channel and the first bad sample, when the file
        is missing, damaged, foreign, of a later version or inconsistent.
    """
    file_path = Path(path)
    wrong = not_a_run(file_path)
    if wrong:
        raise RunFileError(wrong)
    with open_hdf5(file_path, RunFileError, limits=limits) as file:
        try:
            return _read_open(file, file_path)
        except RunFileError as error:
            raise RunFileError(f"{file_path}: {error}") from None
        except DAMAGE as error:
            reason = " ".join(str(error).split())[:160]
            raise RunFileError(f"{file_path}: damaged or not an HDF5 file ({reason})") from error


def _read_open(file: h5py.File, path: Path) -> Run:
    _check_format(file)
    samples = _integer(file, "samples")
    group = file.get("channels")
    if not isinstance(group, h5py.Group):
        raise RunFileError("group /channels is missing: this is not the layout of a run file")
    channels = {name: read_channel(group, name) for name in group}
    for name, values in channels.items():
        if values.size != samples:
            first = min(values.size, samples)
            raise RunFileError(
                f"channel {name}: {values.size} samples, attribute samples is {samples}: first bad sample {first}"
            )
    return run_from_attributes(file, channels, path)


def run_from_attributes(file: h5py.File, channels: Mapping[str, NDArray[np.float64]], path: Path | None) -> Run:
    """Make the Run of an open file out of its attributes and of channels that were read from it."""
    return Run(
        run_id=_text(file, "run_id"),
        created=_text(file, "created"),
        specimen=_text(file, "specimen"),
        sample_rate_hz=_number(file, "sample_rate"),
        period_samples=_integer(file, "period_samples"),
        excitation_kind=_text(file, "excitation_kind"),
        status=_text(file, "status"),
        channels=channels,
        units={name: unit for name in channels if (unit := _unit(file["channels"][name])) is not None},
        design=_design(file),
        events=_events(file),
        events_utc=_event_stamps(file),
        setup=get_setup(file),
        test_id=_text(file, "test_id", ""),
        campaign_id=_text(file, "campaign_id", ""),
        rig=_text(file, "rig", ""),
        operator=_text(file, "operator", ""),
        software_version=_text(file, "software_version", ""),
        imported=_json(file, "imported"),
        path=path,
    )


def _check_format(file: h5py.File) -> None:
    found = _text(file, "format", "")
    if found != FORMAT:
        raise RunFileError(f"attribute format is {found!r:.60}: a run file says {FORMAT!r}")
    version = _integer(file, "format_version")
    if not 1 <= version <= FORMAT_VERSION:
        raise RunFileError(f"format_version is {version}: this program reads version {FORMAT_VERSION}; use a later one")


def read_channel(group: h5py.Group, name: str) -> NDArray[np.float64]:
    """Read one channel as float64, exactly; raise RunFileError for anything but a 1-D array of real numbers."""
    dataset = group[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.dtype.kind not in "fiu" or dataset.ndim != 1:
        raise RunFileError(f"channel {name}: not a 1-D array of numbers, it must be float64 [samples]")
    try:
        return np.asarray(dataset[...], dtype=np.float64)
    except OSError as error:
        raise RunFileError(f"channel {name}: damaged from sample {_first_unreadable(dataset)} on") from error


def _first_unreadable(dataset: h5py.Dataset) -> int:
    step = dataset.chunks[0] if dataset.chunks else max(dataset.size, 1)
    for start in range(0, dataset.size, step):
        try:
            dataset[start : start + step]
        except OSError:
            return start
    return 0


def _attribute(file: h5py.File, name: str) -> object:
    if name not in file.attrs:
        raise RunFileError(f"attribute {name} is missing")
    value = file.attrs[name]
    if isinstance(value, np.ndarray) and value.size == 1:  # MATLAB writes a number as an array of one
        value = value.reshape(-1)[0]
    return value.item() if isinstance(value, np.generic) else value


def _text(file: h5py.File, name: str, default: str | None = None) -> str:
    if default is not None and name not in file.attrs:
        return default
    value = _attribute(file, name)
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if not isinstance(value, str):
        raise RunFileError(f"attribute {name} is {value!r:.60}: it must be text")
    return value


def _number(file: h5py.File, name: str) -> float:
    value = _attribute(file, name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RunFileError(f"attribute {name} is {value!r:.60}: it must be a number")
    return float(value)


def _integer(file: h5py.File, name: str) -> int:
    value = _number(file, name)
    if not value.is_integer():
        raise RunFileError(f"attribute {name} is {value}: it must be an integer")
    return int(value)


def _unit(dataset: h5py.Dataset) -> str | None:
    value = dataset.attrs.get("unit")
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if value is None or isinstance(value, h5py.Empty):
        return None
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return UNIT_SPELLINGS.get(text, text)


def _design(file: h5py.File) -> dict[str, Any] | None:
    group = file.get("excitation")
    return None if group is None else _json(group, "design")


def _json(place: h5py.Group, name: str) -> dict[str, Any] | None:
    """An attribute that holds a JSON object; None where there is no such attribute."""
    if name not in place.attrs:
        return None
    try:
        found = parse_json(place.attrs[name])
    except (ValueError, TypeError) as error:
        raise RunFileError(f"{place.name}: attribute {name} is not JSON ({error})") from error
    if not isinstance(found, dict):
        raise RunFileError(f"{place.name}: attribute {name} must be a JSON object")
    return found


def _events(file: h5py.File) -> tuple[tuple[float, str], ...]:
    group = file.get("events")
    if not isinstance(group, h5py.Group) or "time" not in group or "text" not in group:
        return ()
    times, texts = group["time"][...], group["text"][...]
    return tuple(
        (float(time), text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text))
        for time, text in zip(times, texts, strict=False)
    )


def _event_stamps(file: h5py.File) -> tuple[str, ...]:
    stamps = file.get("events/utc")
    if not isinstance(stamps, h5py.Dataset) or stamps.dtype.kind != "S":
        return ()
    return tuple(stamp.decode("utf-8", "replace") for stamp in stamps[...])


def write_run(path: str | os.PathLike[str], run: Run) -> None:
    """Write one run file under a temporary name, force it to the disk, rename it: no half file ever stays."""
    with (
        written_whole(Path(path), RunFileError) as temporary,
        h5py.File(temporary, "w", libver=("earliest", "v110")) as file,
    ):
        write_attributes(file, run)
        file.attrs["samples"] = run.samples
        for name, values in run.channels.items():
            write_unit(file.create_dataset(f"channels/{name}", data=values), run.units[name])
        put_setup(file, run.setup)
        times = np.array([time for time, _ in run.events], dtype=np.float64)
        file.create_dataset("events/time", data=times).attrs["unit"] = "s"
        file.create_dataset("events/text", data=[encode_event(text) for _, text in run.events], dtype=f"S{EVENT_BYTES}")
        if run.events_utc:
            file.create_dataset("events/utc", data=[t.encode() for t in run.events_utc], dtype=f"S{UTC_BYTES}")


def encode_event(text: str) -> bytes:
    """Cut an event's text to what the file's fixed-length field holds, never inside a character."""
    return text.encode()[:EVENT_BYTES].decode("utf-8", "ignore").encode()


def write_attributes(file: h5py.File, run: Run) -> None:
    """Write everything of a run but its samples and events."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["run_id"] = run.run_id
    file.attrs["created"] = run.created
    file.attrs["specimen"] = run.specimen
    file.attrs["sample_rate"] = float(run.sample_rate_hz)
    file.attrs["period_samples"] = int(run.period_samples)
    file.attrs["excitation_kind"] = str(run.excitation_kind)  # h5py refuses a member of an enumeration
    file.attrs["status"] = run.status
    for name in ("test_id", "campaign_id", "rig", "operator", "software_version"):
        if getattr(run, name):
            file.attrs[name] = getattr(run, name)
    if run.imported is not None:
        file.attrs["imported"] = json.dumps(dict(run.imported))
    if run.design is not None:
        file.create_group("excitation").attrs["design"] = json.dumps(dict(run.design))


def write_unit(dataset: h5py.Dataset, unit: str) -> None:
    """Name a channel's unit, with the description that the layout asks for."""
    dataset.attrs["unit"] = unit
    dataset.attrs["description"] = ""


def with_channel(run: Run, name: str, values: NDArray[np.float64], unit: str) -> Run:
    """Return the run with one more channel, for example ``force_simulated``."""
    channels = {**run.channels, name: np.asarray(values, dtype=np.float64)}
    return replace(run, channels=channels, units={**run.units, name: unit})
