"""Sheets of an XLSX workbook: values, never formulas; what it unpacks to is known before it is unpacked."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.layout import TextOptions, guess_layout
from rigctl.foreign_files.library import extra, read_by_library
from rigctl.foreign_files.table import Progress, Table, Values

__all__ = ["read_workbook"]

MOST_BYTES: Final = 2 << 30  # unpacked: a sheet of 2²⁰ rows, the most that Excel has, and 20 columns has some 1 GB
MOST_RATIO: Final = 200  # unpacked to packed: sheets of measured numbers have 3 to 10, constant ones up to 100
_FREE: Final = 16 << 20
_LOOKED_AT: Final = 200  # rows in which the headings are sought
_EPOCH: Final = datetime(1899, 12, 30)
MOST_COLUMNS: Final = 16_384


def read_workbook(path: Path, given: TextOptions) -> tuple[Table, ...]:
    """A table for each sheet that holds numbers; raises ForeignFileError.

    A cell with a formula counts by the value that the program stored which wrote the file.
    """
    _check_archive(path)
    openpyxl = extra("openpyxl", "XLSX")
    with read_by_library("XLSX"), path.open("rb") as file:  # given a path, it asks for an ending that it knows
        book = openpyxl.load_workbook(file, read_only=True, data_only=True, keep_links=False)
        sheets = [(sheet.title, _rows(sheet)) for sheet in book.worksheets]
        book.close()
    tables, why = [], ""
    for title, rows in sheets:
        try:
            tables.append(_table(title if len(sheets) > 1 else "", rows, given))
        except ForeignFileError as error:
            why = why or str(error)
    if not tables:
        raise ForeignFileError(why or "it has no sheet of cells")
    return tuple(tables)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__


def _check_archive(path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError) as error:
        raise ForeignFileError(f"damaged or not a file of XLSX ({_reason(error)}): save it again") from error
    unpacked, packed = sum(m.file_size for m in members), path.stat().st_size
    if unpacked > min(MOST_BYTES, max(_FREE, MOST_RATIO * packed)) or len(members) > 10_000:
        raise ForeignFileError(f"it unpacks from {packed} to {unpacked} bytes: no measured data do; save it as CSV")


def _rows(sheet: Any) -> list[tuple[Any, ...]]:
    """Any: a cell may hold a number, a text, a date or nothing."""
    rows = []
    for row in sheet.iter_rows(values_only=True):
        if len(row) > MOST_COLUMNS:
            raise ForeignFileError(f"sheet {sheet.title!r:.40} has {len(row)} columns: {MOST_COLUMNS} are the most")
        rows.append(row)
    while rows and all(cell is None for cell in rows[-1]):
        rows.pop()
    return rows


def _table(title: str, rows: Sequence[tuple[Any, ...]], given: TextOptions) -> Table:
    # The layout is guessed from the cells as text, so that sheets and text files have the same rules.
    width = max((k + 1 for row in rows[:_LOOKED_AT] for k, cell in enumerate(row) if cell is not None), default=0)
    lines = ["\t".join(_as_text(cell) for cell in _padded(row, width)) for row in rows[:_LOOKED_AT]]
    stated = TextOptions(delimiter="\t", decimal=given.decimal, header_lines=given.header_lines)
    layout = guess_layout(lines, "", stated)
    body = rows[layout.first :]

    def take(indices: Sequence[int], tell: Progress) -> Values:
        columns = tuple(
            np.array(list(_numbers(body, k, layout.first, layout.decimal)), dtype=np.float64) for k in indices
        )
        tell(1.0)
        stamps = [layout.heads[k].stamps for k in indices]
        return Values(columns=tuple(_since_first(c) if s else c for c, s in zip(columns, stamps, strict=True)))

    return Table(
        heads=layout.heads,
        take=take,
        part=title,
        sample_rate_hz=layout.sample_rate_hz,
        layout=f"XLSX, data from row {layout.first + 1}",
        row=lambda n: f"row {layout.first + n + 1}",
    )


def _padded(row: Sequence[Any], width: int) -> list[Any]:
    return [*row[:width], *[None] * (width - len(row))]


def _as_text(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return str(cell)
    if isinstance(cell, int | float):
        return repr(float(cell))
    if isinstance(cell, datetime | time):
        return cell.isoformat(sep=" ") if isinstance(cell, datetime) else cell.isoformat()
    if isinstance(cell, timedelta):
        return "00:00:00"
    return " ".join(str(cell).split())


def _numbers(body: Sequence[tuple[Any, ...]], column: int, first: int, decimal: str) -> Iterator[float]:
    for n, row in enumerate(body):
        cell = row[column] if column < len(row) else None
        if cell is None or cell == "":
            yield float("nan")
        elif isinstance(cell, int | float) and not isinstance(cell, bool):
            yield float(cell)
        elif isinstance(cell, datetime | date | time | timedelta):
            yield _seconds(cell)
        else:
            yield _from_text(cell, first + n + 1, column, decimal)


def _from_text(cell: Any, row: int, column: int, decimal: str) -> float:
    text = str(cell).strip()
    try:
        return float(text.replace(",", ".") if decimal == "," else text)
    except ValueError as error:
        wrong = f"row {row}, column {column + 1}: {text!r:.40} where a number is due: correct the cell"
        raise ForeignFileError(wrong) from error


def _seconds(cell: datetime | date | time | timedelta) -> float:
    if isinstance(cell, datetime):
        return (cell.replace(tzinfo=None) - _EPOCH).total_seconds()
    if isinstance(cell, timedelta):
        return cell.total_seconds()
    if isinstance(cell, time):
        return 3600.0 * cell.hour + 60.0 * cell.minute + cell.second + 1e-6 * cell.microsecond
    return (datetime(cell.year, cell.month, cell.day) - _EPOCH).total_seconds()


def _since_first(seconds: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    known = seconds[np.isfinite(seconds)]
    return seconds - known[0] if known.size else seconds
