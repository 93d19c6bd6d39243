"""The lines of data of a text file that Arrow cannot read as it is: other encodings, line ends and runs of spaces."""

from __future__ import annotations

import codecs
import io
import re
from functools import partial
from pathlib import Path
from typing import Final

from rigctl.foreign_files.layout import Layout

__all__ = ["BLOCK", "TextBody"]

BLOCK: Final = 4 << 20  # bytes that are parsed at once: a line of 10⁴ columns has 0.2 MB
_MINUS: Final = "−".encode()
_EXPONENT: Final = re.compile(rb"(?<=[\d.,])[dD](?=[+-]?\d)")


class TextBody(io.RawIOBase):
    """The lines of data as UTF-8, with one space between columns where spaces separate them."""

    def __init__(self, path: Path, layout: Layout, most: int | None) -> None:
        self._file, self._layout = path.open("rb"), layout
        self._size = path.stat().st_size if most is None else most
        self._decoder = codecs.getincrementaldecoder(layout.encoding)() if "16" in layout.encoding else None
        self._ready, self._carry, self._read = b"", b"", 0
        self._skip = layout.first
        if layout.encoding == "utf-8-sig":
            self._file.seek(3)
            self._read = 3

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        if size is None or size < 0:
            return b"".join(iter(partial(self.read, BLOCK), b""))
        while not self._ready:
            block = self._file.read(min(BLOCK, self._size - self._read))
            self._read += len(block)
            self._ready = self._cleaned(block)
            if not block:
                break
        out, self._ready = self._ready[:size], self._ready[size:]
        return out

    def close(self) -> None:
        self._file.close()
        super().close()

    def _cleaned(self, block: bytes) -> bytes:
        end = not block
        if self._layout.carriage_returns:
            block = block.replace(b"\r", b"\n")
        if self._decoder is not None:
            block = self._decoder.decode(block, end).encode()
        while self._skip and (block or self._carry):
            line, found, block = (self._carry + block).partition(b"\n")
            self._carry = b""
            if not found:
                self._carry = line
                return b""
            self._skip -= 1
        if self._layout.delimiter != " " and not self._layout.odd_signs:
            return block
        whole, found, self._carry = (self._carry + block).rpartition(b"\n") if not end else (self._carry, b"", b"")
        if self._layout.odd_signs:
            whole = _EXPONENT.sub(b"E", whole.replace(_MINUS, b"-"))
        if self._layout.delimiter == " ":
            whole = re.sub(rb"(?m)^ | (?=\r?$)", b"", re.sub(rb"[ \t]+", b" ", whole))
        return whole + found
