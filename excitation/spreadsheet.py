"""Excitation files as CSV that a spreadsheet opens: one header line, one line a sample.

The last column, `description`, holds in its first cell, as JSON, everything else about the excitation.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.kinds import Kind
from excitation.signal import JSON, Excitation
from excitation.untrusted import parse_json

__all__ = ["TIME", "check_last_line", "check_samples", "measured_rate", "read_csv", "read_description", "write_csv"]

TIME, _DISPLACEMENT, _CURRENT = "time (s)", "displacement_command (m)", "current_command (A)"
_DESCRIPTION = "description"
_LONGEST_LINE = 1 << 22  # bytes of a line that is looked at as the last one; a description has some 10 kB
_AGREE = 1e-3  # of the rate: a time is rounded, and no clock is off by as much


def write_csv(path: Path, excitation: Excitation) -> None:
    """Writes one excitation; numbers are written so that they read back exactly."""
    columns = [excitation.displacement_m.tolist()]
    if excitation.current_a is not None:
        columns.append(excitation.current_a.tolist())
    names = [TIME, _DISPLACEMENT, _CURRENT][: 1 + len(columns)]
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*names, _DESCRIPTION])
        for n, row in enumerate(zip(*columns, strict=True)):
            said = json.dumps(_described(excitation)) if n == 0 else ""
            out.writerow([n / excitation.sample_rate_hz, *row, said])


def _described(excitation: Excitation) -> dict[str, JSON]:
    return {
        "excitation_kind": str(excitation.kind),
        "sample_rate": excitation.sample_rate_hz,
        "period_samples": excitation.period_samples,
        "samples": excitation.samples,
        "design": excitation.design,
        "figures": excitation.figures,
    }


def read_csv(path: Path) -> Excitation:
    """Reads one excitation: one of ours, or any table with the columns time (s) and displacement_command (m).

    Without the column `description` the sample rate is that of the time column, the kind "custom".

    Raises ExcitationFileError that names file, line and what would be right.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.reader(file)
        header = next(rows, [])
        for name in (TIME, _DISPLACEMENT):
            if name not in header:
                raise ExcitationFileError(
                    f"{path}: line 1 has no column {name!r}: it has {', '.join(header) or 'none'}"
                )
        table = [row for row in rows if row]
    check_last_line(path, header)
    names = [name for name in (TIME, _DISPLACEMENT, _CURRENT) if name in header]
    for name in names:
        if header.count(name) > 1:
            raise ExcitationFileError(f"{path}: line 1: column {name!r} stands twice: leave one of them out")
    samples = {name: _numbers(path, table, header.index(name), name) for name in names}
    said = read_description(path, table[0], header)
    check_samples(path, said, len(table))
    measured_hz = measured_rate(path, np.array(samples[TIME]))
    try:
        return Excitation(
            kind=Kind(said.get("excitation_kind", Kind.CUSTOM)),
            sample_rate_hz=_agreed(path, float(said.get("sample_rate", measured_hz)), measured_hz),
            period_samples=int(said.get("period_samples", 0)),
            displacement_m=np.array(samples[_DISPLACEMENT]),
            current_a=np.array(samples[_CURRENT]) if _CURRENT in samples else None,
            design=said.get("design", {}),
            figures=said.get("figures", {}),
        )
    except (TypeError, ValueError) as error:
        if isinstance(error, ExcitationFileError):
            raise
        raise ExcitationFileError(f"{path}: {error}") from error


def _numbers(path: Path, table: list[list[str]], column: int, name: str) -> list[float]:
    values = []
    for line, row in enumerate(table, start=2):
        try:
            values.append(float(row[column]))
        except (ValueError, IndexError) as error:
            shown = repr(row[column]) if column < len(row) else "missing"
            raise ExcitationFileError(f"{path}: line {line}, {name} is {shown}: it must be a number") from error
    if len(values) < 2:
        raise ExcitationFileError(f"{path}: {len(values)} samples: an excitation needs two or more")
    return values


def check_samples(path: Path, said: Mapping[str, Any], samples: int) -> None:
    """Raises ExcitationFileError where the description states another number of samples. Any: JSON."""
    if said.get("samples", samples) != samples:
        raise ExcitationFileError(
            f"{path}: {samples} samples: line 2 says samples = {said['samples']}; the file is cut off or was edited"
        )


def check_last_line(path: Path, header: Sequence[str]) -> None:
    """Raises ExcitationFileError where the last line has no end and fewer cells than the header: it was cut off there.

    Its last number may then be a shorter one. The lines that this program writes end, in an empty cell or not.
    """
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _LONGEST_LINE))
        end = file.read()
    if not end or end.endswith((b"\n", b"\r")):
        return
    last = end.splitlines()[-1].decode("utf-8", errors="replace")
    cells = len(next(csv.reader([last]), []))
    if cells < len(header):
        raise ExcitationFileError(
            f"{path}: the last line has {cells} of {len(header)} cells and no end: the file is cut off there"
        )


def read_description(path: Path, row: list[str], header: list[str]) -> dict[str, Any]:
    """What line 2 says beside its numbers. Any: JSON as somebody may have edited it; the caller converts."""
    column = header.index(_DESCRIPTION) if _DESCRIPTION in header else len(header)
    text = row[column] if len(row) > column else ""
    try:
        said = parse_json(text or "{}")
    except ValueError as error:
        raise ExcitationFileError(f"{path}: line 2, {_DESCRIPTION} is not JSON: {error}") from error
    if not isinstance(said, dict):
        raise ExcitationFileError(f"{path}: line 2, {_DESCRIPTION} is {text[:40]!r}: it must be a JSON object")
    return said


def measured_rate(path: Path, time_s: NDArray[np.float64]) -> float:
    """The rate of the time column, (N,), which must be uniform to 0.1 % of a sample."""
    if time_s.size < 2:
        raise ExcitationFileError(f"{path}: {time_s.size} times: a sample rate needs two or more")
    spacing = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    even = time_s[0] + np.arange(time_s.size) * spacing
    uneven = np.flatnonzero(~(np.abs(time_s - even) <= 1e-3 * abs(spacing) + 1e-9 * np.abs(time_s)))
    if uneven.size or not spacing > 0:
        raise ExcitationFileError(
            f"{path}: line {2 + (int(uneven[0]) if uneven.size else 1)}: time does not rise evenly: every sample needs "
            "the same spacing"
        )
    return _tidy(1.0 / spacing)


def _agreed(path: Path, stated_hz: float, measured_hz: float) -> float:
    """The stated rate, where the times are those of this rate."""
    if not abs(stated_hz - measured_hz) <= _AGREE * measured_hz:
        raise ExcitationFileError(
            f"{path}: the times are those of {measured_hz:.6g} Hz and sample_rate is {stated_hz:g} Hz: correct one"
        )
    return stated_hz


def _tidy(rate_hz: float) -> float:
    """A rate within rounding of nine digits of a whole number is that number."""
    return float(round(rate_hz)) if abs(rate_hz - round(rate_hz)) < 1e-6 * rate_hz else rate_hz
