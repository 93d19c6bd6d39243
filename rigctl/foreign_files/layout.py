"""How a text file holds a table: encoding, delimiter, decimal sign, lines before the data, names and units.

Everything is guessed from the first lines of the file and can be stated instead.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.headings import Head, role_of, split_heading
from rigctl.foreign_files.units import clean_unit, is_spelling

__all__ = ["DELIMITERS", "Layout", "TextOptions", "cells_of", "encoding_of", "guess_layout", "is_number", "is_stamp"]

DELIMITERS: Final = {"tab": "\t", "semicolon": ";", "comma": ",", "bar": "|", "spaces": " "}
MOST_COLUMNS: Final = 20_000  # a spreadsheet has 16 384
_LOOKED_AT: Final = 50  # lines: more only cost time, fewer are swayed by one that is odd
_FEW: Final = 3  # lines of a file that is nearly all headings
_FITTING: Final = 0.8  # share of these lines that must look alike
_ABOVE: Final = 6  # lines above the data in which names and units are sought

_MARKS: Final = (
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe\0\0", ""),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
_NUMBER = {
    ".": re.compile(r"[+−-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+−-]?\d+)?"),
    ",": re.compile(r"[+−-]?(?:\d+,?\d*|,\d+)(?:[eEdD][+−-]?\d+)?"),
}
_ODD_SIGN = re.compile(r"−|(?<=[\d.,])[dD](?=[+-]?\d)")  # a typographic minus, an exponent as Fortran writes it
_STAMP = re.compile(r"(?:.*[\dT ])?\d{1,2}:\d{2}(?::\d{2}(?:[.,:]\d+)?)?(?:\s*[AaPp][Mm])?(?:Z|[+-]\d{2}:?\d{2})?")
_MISSING = frozenset(("", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "+inf", "#n/a", "1.#qnan"))
_RATE = re.compile(
    r"(?:sampl\w*[ _-]*(?:rate|freq\w*)|abtast(?:rate|frequenz)|(?:scan|data|log\w*)[ _-]*rate|messrate|"
    r"fr[eé]quence d.[eé]chantillonnage|frecuencia de muestreo|frequenza di campionamento)"
    r"[^\d\n]{1,20}?(\d+(?:[.,]\d+)?)\s*(k?Hz|S/s|1/s)?",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TextOptions:
    """What is stated about a text file instead of guessed; None where nothing is."""

    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    header_lines: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How the table is written. ``first`` is the index of the first line of data, from 0."""

    encoding: str
    delimiter: str
    decimal: str
    first: int
    heads: tuple[Head, ...]
    sample_rate_hz: float | None = None
    carriage_returns: bool = False  # lines end with these alone
    odd_signs: bool = False  # numbers with a typographic minus, or with an exponent that begins with D

    def __str__(self) -> str:
        name = next(name for name, sign in DELIMITERS.items() if sign == self.delimiter)
        sign = "comma" if self.decimal == "," else "point"
        return f"{self.encoding}, columns apart by {name}, decimal {sign}, data from line {self.first + 1}"


def encoding_of(start: bytes) -> str:
    """The encoding by its mark, or else UTF-8 where that decodes, UTF-16 where every other byte is 0, Windows-1252.

    Raises ForeignFileError where the bytes are no text.
    """
    for mark, name in _MARKS:
        if start.startswith(mark):
            if not name:
                raise ForeignFileError("its text is UTF-32: save it as UTF-8")
            return name
    if b"\0" in start:
        even, odd = start[0::2].count(0), start[1::2].count(0)
        if max(even, odd) > 0.3 * len(start) / 2 and min(even, odd) < 0.05 * len(start) / 2:
            return "utf-16-le" if odd > even else "utf-16-be"
        raise ForeignFileError("neither a text nor a format that is read: its bytes are binary")
    try:
        start[: len(start) - 4 if len(start) > 4 else None].decode("utf-8")
    except UnicodeDecodeError as error:
        if error.start < len(start) - 8:
            return "cp1252"
    return "utf-8"


def is_number(text: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal sign."""
    return _NUMBER[decimal].fullmatch(text.strip()) is not None


def is_stamp(text: str) -> bool:
    """Whether a cell is a time of day, with or without its date."""
    return len(text) <= 40 and _STAMP.fullmatch(text.strip()) is not None


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of one line, without quotes and outer spaces; an empty last one is no cell."""
    if delimiter == " ":
        return line.split()
    try:
        cells = next(csv.reader([line], delimiter=delimiter, strict=False), [])
    except csv.Error:  # a cell of more than 131 072 characters
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]


def guess_layout(lines: Sequence[str], encoding: str, given: TextOptions) -> Layout:
    """The layout of a table from the first lines of its file, without their ends.

    Raises ForeignFileError where no columns of numbers are found, or where names and columns do not agree.
    """
    if not any(line.strip() for line in lines):
        raise ForeignFileError("it is empty: give a file with a line for each sample")
    signs = list(DELIMITERS.values()) if given.delimiter is None else [given.delimiter]
    decimals = (".", ",") if given.decimal is None else (given.decimal,)
    found = [_try(lines, sign, decimal, given) for sign in signs for decimal in decimals if _possible(sign, decimal)]
    best = max(found, key=lambda one: one.merit)
    if best.merit <= (0.0, 0):
        raise ForeignFileError(
            "no table of numbers with two columns or more is found: state --delimiter, --decimal or --header-lines"
        )
    names = _names_above(lines[: best.first], best)
    heads = tuple(
        replace(head, stamps=k in best.stamps, number=k in best.numbers | best.stamps) for k, head in enumerate(names)
    )
    return Layout(
        encoding=encoding,
        delimiter=best.delimiter,
        decimal=best.decimal,
        first=best.first,
        heads=heads,
        sample_rate_hz=_stated_rate(lines[: best.first]),
        odd_signs=any(_odd(cells_of(line, best.delimiter), best) for line in lines[best.first :]),
    )


def _odd(row: Sequence[str], trial: _Trial) -> bool:
    """Whether a line has numbers with such signs. That of a later line is refused with its number."""
    return len(row) == trial.count and any(_ODD_SIGN.search(row[k]) for k in trial.numbers)


def _possible(delimiter: str, decimal: str) -> bool:
    return not (delimiter == "," and decimal == ",")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Trial:
    """The table as one delimiter and one decimal sign show it; ``merit``: share and count of columns of numbers."""

    delimiter: str
    decimal: str
    count: int = 0
    numbers: frozenset[int] = frozenset()
    stamps: frozenset[int] = frozenset()
    empty_last: bool = False  # each line ends with a delimiter
    first: int = 0
    merit: tuple[float, int] = (0.0, 0)


def _try(lines: Sequence[str], delimiter: str, decimal: str, given: TextOptions) -> _Trial:
    nothing = _Trial(delimiter=delimiter, decimal=decimal)
    begin = given.header_lines or 0
    full = [k for k in range(begin, len(lines)) if lines[k].strip()]
    last = full[-_LOOKED_AT - 1 : -1] if len(full) > _FEW else full[-1:]  # the very last line may be cut off
    rows = {k: cells_of(lines[k], delimiter) for k in last}
    if not rows:
        return nothing
    count = Counter(len(row) for row in rows.values()).most_common(1)[0][0]
    alike = [row for row in rows.values() if len(row) == count]
    if not 2 <= count <= MOST_COLUMNS or len(alike) < _FITTING * len(rows):
        return nothing
    kinds = [_kind([row[k] for row in alike], decimal) for k in range(count)]
    numbers = frozenset(k for k, kind in enumerate(kinds) if kind == "number")
    stamps = frozenset(k for k, kind in enumerate(kinds) if kind == "stamp")
    if not numbers or len(numbers | stamps) < 2:
        return nothing
    share = len(numbers | stamps) / max(1, sum(kind != "empty" for kind in kinds))
    trial = replace(
        nothing,
        count=count,
        numbers=numbers,
        stamps=stamps,
        empty_last=kinds[-1] == "empty",
        merit=(share, len(numbers | stamps)),
    )
    first = given.header_lines
    if first is None:
        first = _first_of_data(lines, full, trial)
    return nothing if first is None else replace(trial, first=first)


def _first_of_data(lines: Sequence[str], full: Sequence[int], trial: _Trial) -> int | None:
    """The first line of data: one that fits and is followed by another, or is the only one."""
    fit = [_fits(cells_of(lines[k], trial.delimiter), trial) for k in full]
    two = next((k for k, this, following in zip(full, fit, fit[1:], strict=False) if this and following), None)
    return two if two is not None else next((k for k, this in zip(full, fit, strict=True) if this), None)


def _kind(cells: Sequence[str], decimal: str) -> str:
    """What most cells of a column are."""
    known = [cell for cell in cells if cell.casefold() not in _MISSING]
    if not known:
        return "empty"
    if sum(is_number(cell, decimal) for cell in known) >= _FITTING * len(known):
        return "number"
    return "stamp" if sum(is_stamp(cell) for cell in known) >= _FITTING * len(known) else "text"


def _fits(row: Sequence[str], trial: _Trial) -> bool:
    """Whether a line is one of the data: a number wherever its column has numbers, or nothing."""
    if len(row) != trial.count:
        return False
    cells = [(row[k], is_number(row[k], trial.decimal)) for k in trial.numbers]
    return all(number or cell.casefold() in _MISSING for cell, number in cells) and any(number for _, number in cells)


def _names_above(above: Sequence[str], trial: _Trial) -> list[Head]:
    """The heads from the lines above the data; "column 1", "column 2" … where there are none."""
    rows = [(k, _heading_cells(above[k], trial)) for k in range(len(above) - 1, -1, -1)][: 4 * _ABOVE]
    rows = [(k, row) for k, row in rows if any(re.search(r"\w", cell) for cell in row)][:_ABOVE]
    if rows:
        _refuse_broken_row(rows[0], trial)
    rows = [(k, _without_comment(row, trial.count)) for k, row in rows]
    if trial.empty_last:  # no delimiter at the end of the headings
        rows = [(k, [*row, ""] if len(row) == trial.count - 1 else row) for k, row in rows]
    whole = [(k, row) for k, row in rows if len(row) == trial.count and sum(map(bool, row)) >= min(2, trial.count)]
    under = next((one for one in whole if _is_units_row(one[1])), None) if len(whole) > 1 else None
    units = (
        [clean_unit(cell) if is_spelling(cell) or cell[:1] in ("[", "(") else "" for cell in under[1]] if under else []
    )
    whole = [one for one in whole if one is not under]
    if not whole:
        if rows and len(rows[0][1]) > 1:
            raise ForeignFileError(
                f"line {rows[0][0] + 1} has {len(rows[0][1])} headings and the data have {trial.count} columns: "
                "state --delimiter and --decimal, or correct the headings"
            )
        return [Head(f"column {k + 1}", units[k] if units else "") for k in range(trial.count)]
    names = max(whole, key=lambda one: (sum(bool(role_of(split_heading(cell))[0]) for cell in one[1]), one[0]))[1]
    heads = [split_heading(name) for name in names]
    return [replace(head, unit=units[k]) if units and units[k] else head for k, head in enumerate(heads)]


def _without_comment(row: list[str], count: int) -> list[str]:
    """LabVIEW writes one heading more than columns: for comments."""
    return row[:-1] if len(row) == count + 1 and row[-1].casefold() in ("", "comment") else row


def _heading_cells(line: str, trial: _Trial) -> list[str]:
    text = re.sub(r"^\s*(?:#|%|//|;(?=\s))\s*", "", line)
    if trial.delimiter != " ":
        return cells_of(text, trial.delimiter)
    wide = [cell.strip() for cell in re.split(r"\t|\s{2,}", text.strip())]
    if len(wide) == trial.count:
        return wide
    joined = re.findall(r"\S+(?:\s*[\[(][^\])]*[\])])?", text)
    return joined if len(joined) == trial.count else text.split()


def _refuse_broken_row(row: tuple[int, list[str]], trial: _Trial) -> None:
    """A line of numbers above the first good one is a row of data that cannot be read, and no heading."""
    line, cells = row
    if len(cells) != trial.count:
        return
    known = [k for k in trial.numbers if is_number(cells[k], trial.decimal)]
    if len(known) * 2 >= len(trial.numbers):
        bad = next((cells[k] for k in sorted(trial.numbers) if k not in known), "")
        raise ForeignFileError(
            f"line {line + 1}: {bad!r:.40} where a number is due: correct it, or state --header-lines"
        )


def _is_units_row(row: Sequence[str]) -> bool:
    known = [cell for cell in row if cell]
    units = [cell for cell in known if is_spelling(cell) or (cell[0] in "[(" and len(cell) < 16) or cell == "-"]
    return len(units) * 2 > len(known)


def _stated_rate(above: Sequence[str]) -> float | None:
    """The sample rate that a line above the data states, Hz."""
    for line in above:
        found = _RATE.search(line)
        if found:
            rate = float(found[1].replace(",", ".")) * (1e3 if (found[2] or "").casefold() == "khz" else 1.0)
            return rate or None
    return None
