"""Excitation files as CSV that a spreadsheet opens: one header line, one line a sample.

The two last columns, `property` and `value`, hold in the first lines what the columns of samples cannot say.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from itertools import chain, repeat
from pathlib import Path

import numpy as np

from excitation.errors import ExcitationFileError
from excitation.signal import Excitation, Kind

__all__ = ["read_csv", "write_csv"]

_TIME, _DISPLACEMENT, _CURRENT = "time (s)", "displacement_command (m)", "current_command (A)"
_EXTRA = ["property", "value"]


def write_csv(path: Path, excitation: Excitation) -> None:
    """Writes one excitation; numbers are written so that they read back exactly."""
    columns = [excitation.displacement_m.tolist()]
    if excitation.current_a is not None:
        columns.append(excitation.current_a.tolist())
    names = [_TIME, _DISPLACEMENT, _CURRENT][: 1 + len(columns)]
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*names, *_EXTRA])
        properties = chain(_properties(excitation), repeat(("", "")))
        for n, row in enumerate(zip(*columns, strict=True)):
            out.writerow([n / excitation.sample_rate_hz, *row, *next(properties)])


def _properties(excitation: Excitation) -> Iterator[tuple[str, str]]:
    yield "sample_rate", repr(excitation.sample_rate_hz)
    yield "period_samples", str(excitation.period_samples)
    yield "excitation_kind", str(excitation.kind)
    yield "design", json.dumps(excitation.design)
    yield "figures", json.dumps(excitation.figures)


def read_csv(path: Path) -> Excitation:
    """Reads one excitation: one of ours, or any table with the columns time (s) and displacement_command (m).

    Without the columns `property` and `value` the sample rate is that of the time column, the kind "custom".

    Raises ExcitationFileError that names file, line and what would be right.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.reader(file)
        header = next(rows, [])
        for name in (_TIME, _DISPLACEMENT):
            if name not in header:
                raise ExcitationFileError(
                    f"{path}: line 1 has no column {name!r}: it has {', '.join(header) or 'none'}"
                )
        table = [row for row in rows if row]
    names = [name for name in (_TIME, _DISPLACEMENT, _CURRENT) if name in header]
    samples = {name: _numbers(path, table, header.index(name), name) for name in names}
    properties = _read_properties(table, header)
    rate = _sample_rate(path, samples[_TIME], properties)
    try:
        return Excitation(
            kind=Kind(properties.get("excitation_kind", "custom")),
            sample_rate_hz=rate,
            period_samples=int(properties.get("period_samples", "0")),
            displacement_m=np.array(samples[_DISPLACEMENT]),
            current_a=np.array(samples[_CURRENT]) if _CURRENT in samples else None,
            design=json.loads(properties.get("design", "{}")),
            figures=json.loads(properties.get("figures", "{}")),
        )
    except ValueError as error:
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


def _read_properties(table: list[list[str]], header: list[str]) -> dict[str, str]:
    if not set(_EXTRA) <= set(header):
        return {}
    key, value = (header.index(name) for name in _EXTRA)
    return {row[key]: row[value] for row in table[:32] if len(row) > max(key, value) and row[key]}


def _sample_rate(path: Path, time_s: list[float], properties: dict[str, str]) -> float:
    """The stated rate, or that of the time column, which must then be uniform to 0.1 % of a sample."""
    spacing = (time_s[-1] - time_s[0]) / (len(time_s) - 1)
    uneven = [
        n for n, t in enumerate(time_s) if not abs(t - time_s[0] - n * spacing) <= 1e-3 * abs(spacing) + 1e-9 * abs(t)
    ]
    if not spacing > 0 or uneven:
        line = 2 + (uneven[0] if uneven else 1)
        raise ExcitationFileError(
            f"{path}: line {line}: time does not rise evenly: every sample needs the same spacing"
        )
    try:
        return float(properties["sample_rate"]) if "sample_rate" in properties else _tidy(1.0 / spacing)
    except ValueError as error:
        raise ExcitationFileError(f"{path}: sample_rate is {properties['sample_rate']!r}: not a number") from error


def _tidy(rate_hz: float) -> float:
    """A rate within rounding of nine digits of a whole number is that number."""
    return float(round(rate_hz)) if abs(rate_hz - round(rate_hz)) < 1e-6 * rate_hz else rate_hz
