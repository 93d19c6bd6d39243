"""Arrays of Arrow as arrays of numpy, without Arrow's own way, which loads pandas for a second first."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["floats", "seconds_since_first"]


def floats(piece: Any) -> NDArray[np.float64]:
    """A view of an array of float64, (N,); a copy with NaN where values are missing. Any: Arrow has no types."""
    values = np.frombuffer(piece.buffers()[1], np.float64, len(piece), 8 * piece.offset)
    return np.where(_missing(piece), np.nan, values) if piece.null_count else values


def seconds_since_first(piece: Any) -> NDArray[np.float64]:
    """An array of timestamps in microseconds as seconds since the first of them, (N,), NaN where missing."""
    ticks = np.frombuffer(piece.buffers()[1], np.int64, len(piece), 8 * piece.offset)
    missing = _missing(piece)
    known = ticks[~missing]
    if not known.size:
        return np.full(len(piece), np.nan)
    return np.where(missing, np.nan, (ticks - known[0]) * 1e-6)


def _missing(piece: Any) -> NDArray[np.bool_]:
    bits = piece.buffers()[0]
    if bits is None:
        return np.zeros(len(piece), dtype=bool)
    known = np.unpackbits(np.frombuffer(bits, np.uint8), bitorder="little")
    return np.asarray(known[piece.offset : piece.offset + len(piece)] == 0)
