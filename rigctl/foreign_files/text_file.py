"""Tables in text files (CSV, TXT, and the like), read in one pass by Arrow; only the wanted columns are kept."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.arrow import floats
from rigctl.foreign_files.layout import Layout, TextOptions, cells_of, encoding_of, guess_layout, is_number, is_stamp
from rigctl.foreign_files.stamps import seconds_of
from rigctl.foreign_files.table import Progress, Table, Values
from rigctl.foreign_files.text_body import BLOCK, TextBody

__all__ = ["read_text"]

_START: Final = 1 << 18  # bytes in which headings and layout are sought
_TAIL: Final = 1 << 16
PIECE: Final = 32 << 20  # bytes that are read at once: eight blocks keep all processors busy
_ROOM: Final = 1.05  # of the rows that the first ones let expect: lines become longer
_NULLS: Final = ["", " ", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "-", "--", "#N/A", "1.#QNAN", "None"]


def read_text(path: Path, given: TextOptions) -> tuple[Table, ...]:
    """The one table of a text file; its values are read when they are asked for.

    Raises
    ------
    ForeignFileError
        One line that says what is wrong, with the number of the line where it is one.
    """
    start = _beginning(path, _START)
    encoding = given.encoding or encoding_of(start)
    lines = _lines(path, start, encoding)
    if not lines and start.strip(b"\xef\xbb\xbf\r\n\t "):
        raise ForeignFileError(f"no end of a line in its first {len(start)} bytes: a table has a line for each sample")
    old_mac = b"\n" not in start and b"\r" in start
    layout = replace(guess_layout(lines, encoding, given), carriage_returns=old_mac)
    return (
        Table(
            heads=layout.heads,
            take=partial(_take, path, layout),
            sample_rate_hz=layout.sample_rate_hz,
            layout=str(layout),
            row=lambda n: f"line {_line_of(path, layout, n)}",
        ),
    )


def _beginning(path: Path, size: int) -> bytes:
    with path.open("rb") as file:
        return file.read(size)


def _lines(path: Path, start: bytes, encoding: str) -> list[str]:
    try:
        text = codecs.getincrementaldecoder(encoding)("replace").decode(start)
    except LookupError as error:
        raise ForeignFileError(f"encoding {encoding!r:.40} is unknown: utf-8, utf-16 and cp1252 are usual") from error
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if path.stat().st_size > len(start) or not lines[-1]:
        lines.pop()  # cut off here, or empty
    return lines


def _take(path: Path, layout: Layout, indices: Sequence[int], tell: Progress) -> Values:
    kept, told, cut = _whole_rows(path, layout, indices)
    found = _columns(path, layout, indices, kept, tell)
    columns = [found[k] for k in indices]
    rows = len(columns[0]) if columns else 0
    while rows and all(np.isnan(column[rows - 1]) for column in columns):
        rows -= 1  # empty lines of separators at the end
    return Values(columns=tuple(column[:rows] for column in columns), told=told, cut=cut)


class _Numbers:
    """A column of numbers that grows: what is read is copied at once, so that it lies in memory only once."""

    def __init__(self) -> None:
        self._values, self._size = np.empty(0), 0

    def add(self, piece: Any, share: float) -> None:
        """Any: an array of Arrow. ``share``: of the file, up to its end."""
        size = self._size + len(piece)
        if size > self._values.size:
            larger = np.empty(max(int(_ROOM * size / share), size))
            larger[: self._size] = self._values[: self._size]
            self._values = larger
        self._values[self._size : size] = floats(piece)
        self._size = size

    def whole(self) -> NDArray[np.float64]:
        return self._values[: self._size]


class _Times:
    """A column of times of day."""

    def __init__(self) -> None:
        self._texts: list[str | None] = []

    def add(self, piece: Any, share: float) -> None:
        """Any: an array of Arrow."""
        self._texts += piece.to_pylist()

    def whole(self) -> NDArray[np.float64]:
        return seconds_of(self._texts)


def _columns(
    path: Path, layout: Layout, indices: Sequence[int], most: int | None, tell: Progress
) -> dict[int, NDArray[np.float64]]:
    """The columns with these indices; ``most``: bytes of the file that are read, None for all."""
    import pyarrow as pa

    wanted = list(dict.fromkeys(indices))
    columns = {k: _Times() if layout.heads[k].stamps else _Numbers() for k in wanted}
    plain = _as_it_is(layout, most)
    batches = _batches_of_pieces(path, layout, wanted) if plain else _batches_of_body(path, layout, most, wanted)
    try:
        with ThreadPoolExecutor(1) as keeper:  # a block is copied while the next one is read
            last: Future[None] | None = None
            for share, batch in batches:
                tell(share)
                if last is not None:
                    last.result()
                last = keeper.submit(_keep, [columns[k] for k in wanted], batch, share)
            if last is not None:
                last.result()
    except pa.ArrowInvalid as error:
        raise _reason(path, layout, indices, error) from error
    return {k: column.whole() for k, column in columns.items()}


def _keep(columns: Sequence[_Numbers | _Times], batch: Any, share: float) -> None:
    """Any: a block of rows of Arrow."""
    for column, piece in zip(columns, batch.columns, strict=True):
        column.add(piece, share)


def _batches_of_pieces(path: Path, layout: Layout, wanted: Sequence[int]) -> Iterator[tuple[float, Any]]:
    """The rows of a file that Arrow can read as it is, and the share of it up to their end.

    A piece is read on all processors: Arrow's reader of a stream converts one block after the other, which takes half
    as long again. Any: a table of Arrow.
    """
    import pyarrow as pa
    from pyarrow import csv

    size, done, first = max(path.stat().st_size, 1), 0, layout.first
    for piece in _pieces(path):
        if first or bytes(piece[:BLOCK]).strip() or bytes(piece).strip():
            table = csv.read_csv(pa.BufferReader(piece), *_options(layout, wanted, skip=first))
            rows = 0
            for batch in table.to_batches():
                rows += batch.num_rows
                yield min(1.0, (done + len(piece) * rows / table.num_rows) / size), batch
        done, first = done + len(piece), 0


def _pieces(path: Path) -> Iterator[memoryview]:
    """The bytes of a file in pieces of whole lines, each until the next is asked for; a line that is longer than a
    piece is cut, which no reader takes."""
    bytes_ = bytearray(PIECE)
    room = memoryview(bytes_)
    with path.open("rb", buffering=0) as file:
        held = 0
        while read := file.readinto(room[held:]):
            filled = held + read
            end = bytes_.rfind(b"\n", 0, filled) + 1 or (filled if filled == len(room) else 0)
            if end:
                yield room[:end]
            room[: filled - end] = room[end:filled]
            held = filled - end
        if held:
            yield room[:held]


def _batches_of_body(
    path: Path, layout: Layout, most: int | None, wanted: Sequence[int]
) -> Iterator[tuple[float, Any]]:
    """The same of a file whose text is put right first."""
    import pyarrow as pa
    from pyarrow import csv

    read, parse, convert = _options(layout, wanted, skip=0)
    row_share, rows = 0.0, 0  # of the file, that a row is
    with (
        pa.PythonFile(TextBody(path, layout, most), "r") as stream,
        csv.open_csv(stream, read, parse, convert) as reader,
    ):
        for batch in reader:
            rows += batch.num_rows
            row_share = row_share or BLOCK / max(rows, 1) / path.stat().st_size
            yield min(1.0, rows * row_share), batch


def _as_it_is(layout: Layout, most: int | None) -> bool:
    """Whether Arrow can read the file without help."""
    plain = not layout.carriage_returns and not layout.odd_signs and layout.delimiter != " "
    return most is None and plain and "16" not in layout.encoding


def _options(layout: Layout, wanted: Sequence[int], *, skip: int) -> tuple[Any, Any, Any]:
    """How Arrow reads, parses and converts the wanted columns, in their order. Any: Arrow has no types."""
    import pyarrow as pa
    from pyarrow import csv

    return (
        csv.ReadOptions(
            column_names=[str(k) for k in range(len(layout.heads))],
            block_size=BLOCK,
            skip_rows=skip,
        ),
        csv.ParseOptions(delimiter=layout.delimiter),
        csv.ConvertOptions(
            column_types={str(k): pa.string() if layout.heads[k].stamps else pa.float64() for k in wanted},
            include_columns=[str(k) for k in wanted],
            decimal_point=layout.decimal,
            null_values=_NULLS,
            strings_can_be_null=True,
        ),
    )


def _body_lines(path: Path, layout: Layout) -> Iterator[tuple[int, str]]:
    """Number, from 1, and text of each line of data that is not empty."""
    with path.open(encoding=layout.encoding, errors="replace", newline=None) as file:
        for number, line in enumerate(file, start=1):
            if number > layout.first and line.strip():
                yield number, line.rstrip("\n")


def _line_of(path: Path, layout: Layout, sample: int) -> int:
    return next((number for n, (number, _) in enumerate(_body_lines(path, layout)) if n == sample), 0)


def _reason(path: Path, layout: Layout, indices: Sequence[int], error: Exception) -> ForeignFileError:
    """The first line that cannot be read, sought in a second, slow pass."""
    for number, line in _body_lines(path, layout):
        wrong = _wrong(line, layout, indices)
        if wrong:
            return ForeignFileError(f"line {number}: {wrong}")
    return ForeignFileError(" ".join(str(error).split())[:160])


def _wrong(line: str, layout: Layout, indices: Sequence[int]) -> str:
    cells = cells_of(line, layout.delimiter)
    if len(cells) != len(layout.heads):
        return (
            f"{len(cells)} columns where the lines before have {len(layout.heads)}: correct the line, or leave it out"
        )
    for k in indices:
        head, cell = layout.heads[k], cells[k]
        good = is_stamp(cell) if head.stamps else is_number(cell, layout.decimal)
        if not good and cell not in _NULLS and cell.casefold() not in ("inf", "-inf", "+inf"):
            if role_words(cells):
                return "headings stand here again: the file holds several records, cut it into one file each"
            due = "a time" if head.stamps else "a number"
            return f"{head.name!r:.60} is {cell!r:.40} where {due} is due: correct the line, or leave it out"
    return ""


def role_words(cells: Sequence[str]) -> bool:
    """Whether most cells are words: a line of headings."""
    return sum(bool(re.search(r"[^\W\d_]{2,}", cell)) for cell in cells) * 2 > len(cells)


def _whole_rows(path: Path, layout: Layout, indices: Sequence[int]) -> tuple[int | None, tuple[str, ...], bool]:
    """Bytes of the file without a last line that is cut off (None: all of it), what to tell, and whether it is cut."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - _TAIL) // 2 * 2)
        raw = file.read()
    plain = "16" not in layout.encoding
    end = b"\n" if plain else ("\n".encode("utf-16-be" if layout.encoding == "utf-16-be" else "utf-16-le"))
    if raw.endswith((end, b"\r")) or end not in raw:
        return None, (), False
    start = raw.rindex(end) + len(end)
    if not plain and start % 2:
        return None, (), False
    text = raw[start:].decode(layout.encoding if layout.encoding != "utf-16" else "utf-16-le", "replace")
    before = raw[:start].decode(layout.encoding if layout.encoding != "utf-16" else "utf-16-le", "replace")
    if not text.strip():
        return None, (), False
    kept = size - len(raw) + start
    if _wrong(text, layout, indices):
        return kept, (f"the last line is cut off ({text.strip()[-40:]!r}): it is left out",), True
    if _shorter(text, before.splitlines()[1:], layout):
        return (
            kept,
            (f"the last line has no end and its last value is short ({text[-20:]!r}): left out, it may be cut",),
            False,
        )
    return None, (), False


def _shorter(text: str, before: Sequence[str], layout: Layout) -> bool:
    """Whether the last value has fewer characters than those above it: a number may be cut anywhere."""
    lengths = [len(cells[-1]) for line in before[-50:] if (cells := cells_of(line, layout.delimiter))]
    return len(lengths) > 3 and len(cells_of(text, layout.delimiter)[-1]) < min(lengths)
