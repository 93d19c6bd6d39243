"""The heaps in which HDF5 keeps texts of variable length, read without the HDF5 library.

HDF5 walks through the objects of a heap without a check of their sizes: a size of 0 makes it walk for ever. So every
heap is walked here first (HDF5 File Format Specification, version 3.0, section III.E). A heap is looked for wherever no
channel lies.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator
from typing import Final

from excitation.errors import ExcitationFileError

__all__ = ["check_global_heaps"]

_BEGIN: Final = b"GCOL\x01"
_HEAD: Final = struct.Struct("<4sB3xQ")
_OBJECT: Final = struct.Struct("<HH4xQ")
_LEAST_BYTES: Final = 4096  # of a heap; HDF5 refuses smaller ones, and those beyond the end of the file
_MOST_HEAP_OBJECTS: Final = 1_000_000  # in all; a text is an object, and at most 10 000 texts are read
_PIECE: Final = 1 << 20  # read at once


def check_global_heaps(handle: int, file_bytes: int, data: Iterable[tuple[int, int]]) -> None:
    """Raise ExcitationFileError for a heap in which an object is damaged; ``data`` are first and last + 1 of others."""
    objects = 0
    for start in _heaps(handle, _gaps(file_bytes, data)):
        objects += _check_heap(handle, start, file_bytes)
        if objects > _MOST_HEAP_OBJECTS:
            raise ExcitationFileError(f"more than {_MOST_HEAP_OBJECTS} texts are stored: that is no run")


def _gaps(file_bytes: int, data: Iterable[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    place = 0
    for start, end in sorted(data):
        if start > place:
            yield place, start
        place = max(place, end)
    if place < file_bytes:
        yield place, file_bytes


def _heaps(handle: int, gaps: Iterable[tuple[int, int]]) -> Iterator[int]:
    for start, end in gaps:
        for piece in range(start, end, _PIECE):
            content = os.pread(handle, min(_PIECE + len(_BEGIN) - 1, end - piece), piece)
            found = content.find(_BEGIN)
            while found >= 0:
                yield piece + found
                found = content.find(_BEGIN, found + 1)


def _check_heap(handle: int, start: int, file_bytes: int) -> int:
    """The number of its objects; 0 where these bytes cannot be a heap."""
    head = os.pread(handle, _HEAD.size, start)
    size = _HEAD.unpack(head)[2] if len(head) == _HEAD.size else 0
    if not _LEAST_BYTES <= size <= file_bytes - start:
        return 0
    count, place, end = 0, start + _HEAD.size, start + size
    while end - place >= _OBJECT.size and count <= _MOST_HEAP_OBJECTS:
        index, _, length = _OBJECT.unpack(os.pread(handle, _OBJECT.size, place))
        taken = length if index == 0 else _OBJECT.size + (length + 7) // 8 * 8
        if not _OBJECT.size <= taken <= end - place:
            raise ExcitationFileError(f"damaged: a text of {length} bytes at byte {place} does not fit into its place")
        count, place = count + 1, place + taken
    return count
