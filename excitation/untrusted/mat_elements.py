"""The elements of a MATLAB file (version 5 to 7): whether each array has the values that its dimensions declare.

A reader makes room for as many cells as an array declares before it reads the first: two dimensions of 10⁵ in a file of
200 bytes take 80 GB. Every value takes at least a byte in the file, and every cell and every field of a structure a tag
of 8, so that no whole file declares more (MAT-File Format, MathWorks, chapter 1).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import prod
from typing import Final

from excitation.untrusted.limits import MOST_DEPTH

__all__ = ["MATRIX", "Refusal", "check_matrix"]

MATRIX: Final = 14
_CELL, _STRUCT, _OBJECT, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 5, 16, 17
_TAG: Final = 8
_MOST_HEAD: Final = 1 << 20  # of names of fields and the like, which are read whole

Take = Callable[[int], bytes]  # the next bytes of the element: fewer than asked for where it ends


class Refusal(ValueError):
    """Why the file is refused."""


def check_matrix(take: Take, size: int, order: str, depth: int = 0) -> None:
    """Read one matrix of ``size`` bytes, whose tag has been read; raises Refusal. A cut one is left to the reader."""
    if depth > MOST_DEPTH:
        raise Refusal(f"cells in cells, more than {MOST_DEPTH} levels")
    left = size
    flags, left = _element(take, left, order)
    if len(flags) < 4:
        _skip(take, left)
        return
    kind = struct.unpack_from(f"{order}I", flags)[0] & 0xFF
    if kind == _OPAQUE:  # has no dimensions
        _skip(take, left)
        return
    text, left = _element(take, left, order)
    dimensions = [abs(one) for one in struct.unpack(f"{order}{len(text) // 4}i", text[: len(text) // 4 * 4])]
    _, left = _element(take, left, order)  # its name
    fields = 1
    if kind in (_STRUCT, _OBJECT):
        fields, left = _fields(take, left, order, has_class=kind == _OBJECT)
    holds_elements = kind in (_CELL, _STRUCT, _OBJECT, _FUNCTION)
    declared = prod(dimensions) * max(fields, 1)
    least = _TAG if holds_elements else 1
    if kind == _SPARSE:  # has an index of 4 bytes for each column
        declared, least = dimensions[-1] if dimensions else 0, 4
    if declared > 1 and declared * least > left:
        shown = " x ".join(map(str, dimensions[:4])) + (" x …" if len(dimensions) > 4 else "")
        raise Refusal(f"an array declares {shown} values and has {left} bytes")
    if holds_elements:
        left = _children(take, left, order, depth)
    _skip(take, left)


def _children(take: Take, left: int, order: str, depth: int) -> int:
    while left >= _TAG:
        tag = take(_TAG)
        if len(tag) < _TAG:
            return 0
        left -= _TAG
        kind, size = struct.unpack(f"{order}II", tag)
        if kind != MATRIX or size > left:
            return left
        check_matrix(take, size, order, depth + 1)
        left -= size
    return left


def _fields(take: Take, left: int, order: str, *, has_class: bool) -> tuple[int, int]:
    """How many fields a structure has, and the bytes after their names."""
    if has_class:
        _, left = _element(take, left, order)
    text, left = _element(take, left, order)
    length = struct.unpack_from(f"{order}i", text)[0] if len(text) >= 4 else 0
    names, left = _element(take, left, order)
    return (len(names) // length if length > 0 else 0), left


def _element(take: Take, left: int, order: str) -> tuple[bytes, int]:
    """The content of the next element, small or with its padding, and the bytes that are left."""
    tag = take(min(_TAG, left))
    if len(tag) < _TAG:
        return b"", 0
    left -= _TAG
    kind, size = struct.unpack(f"{order}II", tag)
    if kind >> 16:  # a small one: up to 4 bytes in the tag itself
        return tag[4 : 4 + min(kind >> 16, 4)], left
    padded = size + -size % 8
    if padded > left or size > _MOST_HEAD:
        raise Refusal(f"an element declares {size} bytes where {left} are left")
    return take(padded)[:size], left - padded


def _skip(take: Take, size: int) -> None:
    while size > 0:
        piece = take(min(size, 1 << 20))
        if not piece:
            return
        size -= len(piece)
