"""Averages over neighbouring lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["pooled", "segments"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]


def pooled(values: Floats, width: int) -> Floats:
    """Running mean over ``width`` neighbours (made odd), fewer at the ends, (K,)."""
    half = max(int(width), 1) // 2
    if half == 0 or values.size == 0:
        return values.copy()
    total = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(values.size)
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, values.size)
    out: Floats = (total[high] - total[low]) / (high - low)
    return out


def segments(detection: Lines, size: int) -> list[Lines]:
    """Consecutive detection lines in groups of about ``size``, at least one group."""
    return [np.asarray(part) for part in np.array_split(detection, max(detection.size // size, 1))]
