"""SI columns to packed integer rows and back: the only conversion between samples and counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def to_counts(values: NDArray[np.float64], layout: np.dtype[np.void], lsb: Sequence[float]) -> NDArray[np.void]:
    """Turn SI columns into a packed row per sample; OverflowError where one does not fit."""
    packed = np.empty(values.shape[0], dtype=layout)
    for column, (name, unit) in enumerate(zip(layout.names or (), lsb, strict=True)):
        counts, bounds = np.rint(values[:, column] / unit), np.iinfo(layout[name])
        if counts.size and not (counts.min() >= bounds.min and counts.max() <= bounds.max):
            raise OverflowError(f"{name}: a sample does not fit {layout[name].itemsize * 8} bits")
        packed[name] = counts
    return packed


def from_counts(packed: NDArray[np.void], lsb: Sequence[float]) -> NDArray[np.float64]:
    """Turn packed rows into SI columns."""
    values = np.empty((packed.size, len(lsb)))
    for column, (name, unit) in enumerate(zip(packed.dtype.names or (), lsb, strict=True)):
        values[:, column] = packed[name] * unit
    return values
