"""MATLAB files (version 5 to 7): what their compressed variables unpack to, and what their arrays declare.

A file is a header of 128 bytes and then elements, each with a tag of 8: its type and its bytes (MAT-File Format,
MathWorks, chapter 1). A compressed one is a zlib stream of one other element; scipy unpacks it to its end.
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import Final

from excitation.errors import ExcitationFileError
from excitation.untrusted.limits import FREE_BYTES, MOST_PACKED_RATIO, Limits
from excitation.untrusted.mat_elements import MATRIX, Refusal, check_matrix

__all__ = ["check_mat"]

_HEADER: Final = 128
_COMPRESSED: Final = 15
_PIECE: Final = 1 << 20


def check_mat(path: Path) -> None:
    """Raise ExcitationFileError, one line, where a reader would take more memory than a file of its size can mean."""
    content = path.read_bytes()
    order = "<" if content[126:128] == b"IM" else ">"
    unpacked = _Unpacked(min(Limits().most_bytes, max(FREE_BYTES, MOST_PACKED_RATIO * len(content))))
    place = _HEADER
    try:
        while place + 8 <= len(content):
            kind, size = struct.unpack_from(f"{order}II", content, place)
            inside = content[place + 8 : place + 8 + size]
            if kind == MATRIX:
                check_matrix(BytesIO(inside).read, size, order)
            elif kind == _COMPRESSED:
                unpacked.check(inside, order)
            place += 8 + size
    except Refusal as refusal:
        raise ExcitationFileError(f"{path}: {refusal}: no run or design does") from refusal


class _Unpacked:
    """All compressed variables of a file: what they unpack to, ``most`` bytes together."""

    def __init__(self, most: int) -> None:
        self._most, self._total = most, 0

    def check(self, packed: bytes, order: str) -> None:
        """Raises Refusal."""
        self._unpacking, self._packed, self._ready = zlib.decompressobj(), packed, b""
        tag = self._take(8)
        if len(tag) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            if kind == MATRIX:
                check_matrix(self._take, size, order)
        while self._take(_PIECE):  # a reader unpacks it to its end
            pass

    def _take(self, size: int) -> bytes:
        """The next bytes; fewer where it ends or is damaged, which the reader says."""
        while len(self._ready) < size and not self._unpacking.eof:
            try:
                piece = self._unpacking.decompress(self._packed, _PIECE)
            except zlib.error:
                break
            self._packed = self._unpacking.unconsumed_tail
            self._total += len(piece)
            if self._total > self._most:
                raise Refusal(f"a variable unpacks to more than {self._most} bytes")
            if not piece and not self._packed:
                break
            self._ready += piece
        taken, self._ready = self._ready[:size], self._ready[size:]
        return taken
