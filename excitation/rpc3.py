"""RPC III time histories (.drv, .rsp), the format of servo-hydraulic controllers.

A header of 128-byte records, four to a 512-byte block: 32 bytes keyword, 96 bytes value, both ended by NUL.
Then the data in groups of frames; within a group the points of each channel are contiguous. The last frame is
padded, so the true number of samples has a keyword of its own; other writers' keywords are read, and padding is
recognised where there is none.

Short integers are scaled for each channel, in one of two ways where INT_FULL_SCALE is not 32768:
value = integer · SCALE.CHAN_n · INT_FULL_SCALE/32768, or value = integer · SCALE.CHAN_n. The second is taken where
the limits of the channels are met by it and not by the first.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.kinds import Kind
from excitation.rpc3_length import samples_without_padding, stated_samples
from excitation.signal import JSON, Excitation
from excitation.untrusted import parse_json

__all__ = [
    "Channel",
    "TimeHistory",
    "plain_unit",
    "read_drive",
    "read_rpc3",
    "write_drive",
    "write_response",
    "write_rpc3",
]

_BLOCK, _RECORD, _KEYWORD, _VALUE = 512, 128, 32, 96
_FULL_SCALE = 32768  # so that SCALE alone converts integers, with either convention of readers
_FRAME = 1024
_MOST_PARAMETERS = 1024
_CHUNK = 90  # characters of the design in one value
_OWN = "DAMPER_RIG."
_READ: Final[Mapping[str, tuple[str, ...]]] = {
    "FORMAT": ("BINARY_IEEE_LITTLE_END", "BINARY_IEEE_BIG_END", "BINARY"),
    "FILE_TYPE": ("TIME_HISTORY",),
}
_NEAR_A_LIMIT: Final = 1e-4
"""Share of a channel's limit within which its peak is that limit: the two ways to scale differ by 5e-4 at 32752."""


_FEWER_BITS: Final = _FULL_SCALE // 2
"""Up to here INT_FULL_SCALE is that of a converter with fewer bits: integers that keep within it are counts of that.
Where it is a factor instead, a signal within it uses half of its range or less."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channel:
    """One channel, (N,) in its unit."""

    name: str
    unit: str
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeHistory:
    """What an RPC III file holds; ``keywords`` are those beyond the ones that describe the data."""

    sample_rate_hz: float
    channels: tuple[Channel, ...]
    drive: bool = True  # else a response
    keywords: Mapping[str, str] = field(default_factory=dict)
    padding: int = 0  # samples at the end of the last frame that were left out, without a keyword that says so
    scaling: str = ""  # how integers became values, where the file allows two ways


def write_rpc3(path: Path, history: TimeHistory) -> None:
    """Writes 16-bit integers, each channel scaled to its own peak; the same history gives the same bytes."""
    samples = history.channels[0].values.size
    frames = -(-samples // _FRAME)
    records = _description(history, samples, frames)
    if len(records) > _MOST_PARAMETERS:
        raise ExcitationFileError(f"{path}: {len(records)} header records: RPC III holds {_MOST_PARAMETERS}")
    blocks = -(-len(records) * _RECORD // _BLOCK)
    records["NUM_HEADER_BLOCKS"], records["NUM_PARAMS"] = str(blocks), str(len(records))
    header = b"".join(_record(keyword, value) for keyword, value in records.items()).ljust(blocks * _BLOCK, b"\0")
    data = np.stack([_integers(c.values, frames) for c in history.channels], axis=1)
    path.write_bytes(header + data.astype("<i2").tobytes())


def _description(history: TimeHistory, samples: int, frames: int) -> dict[str, str]:
    """Keyword and value of each header record, the three required ones first."""
    records = {
        "FORMAT": "BINARY_IEEE_LITTLE_END",
        "NUM_HEADER_BLOCKS": "",
        "NUM_PARAMS": "",
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "DRIVE" if history.drive else "RESPONSE",
        "DELTA_T": repr(1.0 / history.sample_rate_hz),
        "CHANNELS": str(len(history.channels)),
        "PTS_PER_FRAME": str(_FRAME),
        "PTS_PER_GROUP": str(_FRAME),
        "FRAMES": str(frames),
        "HALF_FRAMES": "0",
        "REPEATS": "1",
        "DATA_TYPE": "SHORT_INTEGER",
        "INT_FULL_SCALE": str(_FULL_SCALE),
        "PARTITIONS": "1",
        "PART.CHAN_1": "1",
        "PART.NCHAN_1": str(len(history.channels)),
    }
    for number, channel in enumerate(history.channels, start=1):
        records[f"DESC.CHAN_{number}"] = channel.name
        records[f"UNITS.CHAN_{number}"] = channel.unit
        records[f"SCALE.CHAN_{number}"] = repr(_scale(channel.values))
        records[f"LOWER_LIMIT.CHAN_{number}"] = repr(float(channel.values.min()))
        records[f"UPPER_LIMIT.CHAN_{number}"] = repr(float(channel.values.max()))
    own = {"SAMPLES": str(samples), "SAMPLE_RATE": repr(history.sample_rate_hz), **history.keywords}
    return records | {_OWN + key: value for key, value in own.items()}


def _record(keyword: str, value: str) -> bytes:
    key, text = keyword.encode("ascii"), value.encode("ascii", "replace")
    if len(key) >= _KEYWORD or len(text) >= _VALUE:
        raise ExcitationFileError(f"RPC III: {keyword} = {value!r} is too long: 31 and 95 characters fit")
    return key.ljust(_KEYWORD, b"\0") + text.ljust(_VALUE, b"\0")


def _scale(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max()) / (_FULL_SCALE - 1) or 1.0


def _integers(values: NDArray[np.float64], frames: int) -> NDArray[np.int64]:
    """(frames, _FRAME): the last value is held to the end of the last frame, so that there is no step."""
    held = np.concatenate([values, np.full(frames * _FRAME - values.size, values[-1])])
    return np.rint(held / _scale(values)).astype(np.int64).reshape(frames, _FRAME)


def read_rpc3(path: Path) -> TimeHistory:
    """Reads integers or floats; raises ExcitationFileError that names the keyword that is missing or
    wrong.
    """
    content = path.read_bytes()
    keywords = _keywords(path, content)
    count = _number(path, keywords, "CHANNELS")
    frame, group = _number(path, keywords, "PTS_PER_FRAME"), _number(path, keywords, "PTS_PER_GROUP")
    frames = _number(path, keywords, "FRAMES")
    if group % frame:
        raise ExcitationFileError(f"{path}: PTS_PER_GROUP is {group}: it must be a multiple of PTS_PER_FRAME ({frame})")
    kind = keywords.get("DATA_TYPE", "SHORT_INTEGER")
    if kind not in ("SHORT_INTEGER", "FLOATING_POINT"):
        raise ExcitationFileError(f"{path}: DATA_TYPE is {kind!r}: SHORT_INTEGER and FLOATING_POINT are known")
    order = ">" if "BIG" in keywords.get("FORMAT", "") else "<"
    raw = content[_number(path, keywords, "NUM_HEADER_BLOCKS") * _BLOCK :]
    dtype = np.dtype(order + ("i2" if kind == "SHORT_INTEGER" else "f4"))
    groups = -(-frames * frame // group)
    if len(raw) < groups * group * count * dtype.itemsize:
        raise ExcitationFileError(
            f"{path}: {len(raw)} bytes of data: {count} channels of {groups} groups of {group} points need "
            f"{groups * group * count * dtype.itemsize}; the file is cut off"
        )
    grouped = np.frombuffer(raw, dtype=dtype, count=groups * group * count).reshape(groups, count, group)
    data = np.ascontiguousarray(grouped.transpose(0, 2, 1)).reshape(-1, count)[: frames * frame]
    stated = stated_samples(path, keywords, frames * frame)
    samples = samples_without_padding(data, group) if stated is None else stated
    data = data[:samples]
    share, scaling = _full_scale(path, keywords, data) if kind == "SHORT_INTEGER" else (1.0, "")
    channels = tuple(
        Channel(
            name=keywords.get(f"DESC.CHAN_{n}", f"channel {n}"),
            unit=keywords.get(f"UNITS.CHAN_{n}", ""),
            values=(share * _scale_of(path, keywords, n, kind)) * data[:, n - 1].astype(np.float64),
        )
        for n in range(1, count + 1)
    )
    return TimeHistory(
        sample_rate_hz=_rate(path, keywords),
        channels=channels,
        drive=keywords.get("TIME_TYPE", "DRIVE") == "DRIVE",
        keywords={k.removeprefix(_OWN): v for k, v in keywords.items() if k.startswith(_OWN)},
        padding=frames * frame - samples if stated is None else 0,
        scaling=scaling,
    )


def _full_scale(path: Path, keywords: Mapping[str, str], data: NDArray[np.int16]) -> tuple[float, str]:
    """The factor of all integers beside the channels' own, and what it was taken from."""
    full_scale = _real(path, keywords, "INT_FULL_SCALE", str(_FULL_SCALE))
    if full_scale == _FULL_SCALE:
        return 1.0, ""
    share, alone = full_scale / _FULL_SCALE, 0
    most = int(np.abs(data.astype(np.int32)).max(initial=0))
    for number in range(1, data.shape[1] + 1):
        limits = [_real(path, keywords, f"{side}_LIMIT.CHAN_{number}", "0") for side in ("LOWER", "UPPER")]
        reached = np.array([data[:, number - 1].min(), data[:, number - 1].max()], dtype=np.float64)
        scaled = reached * _scale_of(path, keywords, number, "SHORT_INTEGER")
        by = [float(np.abs(factor * scaled - limits).max()) for factor in (share, 1.0)]
        near = _NEAR_A_LIMIT * max(map(abs, limits))
        alone += int(by[1] <= near < by[0]) - int(by[0] <= near < by[1])
    if alone > 0:
        return 1.0, f"integer · SCALE: the channels' limits say that INT_FULL_SCALE {full_scale:g} is no factor"
    if alone == 0 and most <= full_scale <= _FEWER_BITS:
        return 1.0, f"integer · SCALE: no integer is beyond INT_FULL_SCALE {full_scale:g}, which is no factor"
    return share, f"integer · SCALE · {full_scale:g}/{_FULL_SCALE}"


def _scale_of(path: Path, keywords: Mapping[str, str], number: int, kind: str) -> float:
    return 1.0 if kind == "FLOATING_POINT" else _real(path, keywords, f"SCALE.CHAN_{number}", "1.0")


def _keywords(path: Path, content: bytes) -> dict[str, str]:
    """The header; its first block says how many there are."""

    def within(end: int) -> dict[str, str]:
        found = {}
        for start in range(0, min(end, len(content) - _RECORD + 1), _RECORD):
            key = content[start : start + _KEYWORD].split(b"\0")[0].decode("ascii", "replace").strip()
            value = content[start + _KEYWORD : start + _RECORD].split(b"\0")[0].decode("ascii", "replace").strip()
            if key:
                found[key] = value
        return found

    first = within(_BLOCK)
    if "NUM_HEADER_BLOCKS" not in first:
        raise ExcitationFileError(f"{path}: the first 512 bytes name no NUM_HEADER_BLOCKS: this is no RPC III file")
    for keyword, known in _READ.items():
        if first.get(keyword, known[0]) not in known:
            raise ExcitationFileError(
                f"{path}: {keyword} is {first[keyword]!r:.60}: {', '.join(known)} can be read; save it as a binary "
                "time history"
            )
    return within(_number(path, first, "NUM_HEADER_BLOCKS") * _BLOCK)


def _number(path: Path, keywords: Mapping[str, str], keyword: str) -> int:
    text = keywords.get(keyword, "")
    if not text.isdecimal() or int(text) < 1:
        raise ExcitationFileError(f"{path}: {keyword} is {text!r}: it must be a whole number above 0")
    return int(text)


def _real(path: Path, keywords: Mapping[str, str], keyword: str, otherwise: str) -> float:
    text = keywords.get(keyword, otherwise)
    try:
        return float(text)
    except ValueError as error:
        raise ExcitationFileError(f"{path}: {keyword} is {text!r}: it must be a number") from error


def _rate(path: Path, keywords: Mapping[str, str]) -> float:
    if _OWN + "SAMPLE_RATE" in keywords:
        return _real(path, keywords, _OWN + "SAMPLE_RATE", "")
    spacing = _real(path, keywords, "DELTA_T", "0")
    if not spacing > 0.0:
        raise ExcitationFileError(f"{path}: DELTA_T is {spacing:g}: it must be the spacing of samples in s, above 0")
    rate = 1.0 / spacing
    return float(round(rate)) if abs(rate - round(rate)) < 1e-6 * rate else rate


def write_drive(path: Path, excitation: Excitation) -> None:
    """An excitation as a drive file (.drv); 16 bits a sample: displacement to 1/65 534 of its range."""
    _write(path, excitation, drive=True)


def write_response(path: Path, excitation: Excitation) -> None:
    """An excitation as a response file (.rsp): the wanted motion, for a drive-file iteration."""
    _write(path, excitation, drive=False)


def _write(path: Path, excitation: Excitation, *, drive: bool) -> None:
    channels = [Channel(name="displacement_command", unit="m", values=excitation.displacement_m)]
    if excitation.current_a is not None:
        channels.append(Channel(name="current_command", unit="A", values=excitation.current_a))
    keywords = {"PERIOD_SAMPLES": str(excitation.period_samples), "KIND": str(excitation.kind)}
    text = json.dumps(excitation.design)
    for number, start in enumerate(range(0, len(text), _CHUNK)):
        keywords[f"DESIGN_{number:03d}"] = "|" + text[start : start + _CHUNK] + "|"
    write_rpc3(
        path,
        TimeHistory(sample_rate_hz=excitation.sample_rate_hz, channels=tuple(channels), drive=drive, keywords=keywords),
    )


_METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
_AMPERES = {"A": 1.0, "mA": 1e-3, "amp": 1.0}


def plain_unit(unit: str) -> str:
    """The unit as it is written here: some writers have capitals alone (MM, IN, AMP). "MA" could be two units."""
    return unit.lower() if unit in ("M", "MM", "CM", "UM", "IN", "AMP") else "A" if unit == "a" else unit


def read_drive(path: Path) -> Excitation:
    """The first channel in a unit of length as displacement, the first in amperes as current.

    Raises ExcitationFileError where no channel is a length.
    """
    history = read_rpc3(path)
    displacement = next((c for c in history.channels if plain_unit(c.unit) in _METRES), None)
    current = next((c for c in history.channels if plain_unit(c.unit) in _AMPERES), None)
    if displacement is None:
        units = ", ".join(f"{c.name} in {c.unit!r}" for c in history.channels)
        raise ExcitationFileError(f"{path}: no channel in {', '.join(_METRES)}: there are {units}")
    own = history.keywords
    text = "".join(own[key][1:-1] for key in sorted(own) if key.startswith("DESIGN_"))
    try:
        return Excitation(
            kind=Kind(own.get("KIND", Kind.CUSTOM)),
            sample_rate_hz=history.sample_rate_hz,
            period_samples=int(own.get("PERIOD_SAMPLES", "0")),
            displacement_m=displacement.values * _METRES[plain_unit(displacement.unit)],
            current_a=None if current is None else current.values * _AMPERES[plain_unit(current.unit)],
            design=parse_json(text or "{}"),
            figures=_notes(history),
        )
    except ValueError as error:
        raise ExcitationFileError(f"{path}: {error}") from error


def _notes(history: TimeHistory) -> dict[str, JSON]:
    """What was decided while reading a file of another writer."""
    notes: dict[str, JSON] = {"padding_left_out": history.padding} if history.padding else {}
    return {**notes, "scaling": history.scaling} if history.scaling else notes
