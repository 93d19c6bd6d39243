"""Mean and median of a series in a window that slides along it.

They are those of `uniform_filter1d` and `median_filter` of `scipy.ndimage`, to the bit: every periodic record needs
them, and scipy takes 0.3 s to import.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

__all__ = ["running_mean", "running_median"]

Floats = NDArray[np.float64]

_AT_ONCE = 20_000  # windows: of 101 samples they take 16 MB


def running_mean(series: Floats, width: int) -> Floats:
    """Mean of the `width` samples about each sample, (N,); beyond the ends their values go on.

    A window of an even width has one more sample before its own than after it.
    """
    padded = np.pad(series, (width // 2, (width - 1) // 2), mode="edge")
    first = np.cumsum(padded[:width])[-1:]
    return np.asarray(np.cumsum(np.concatenate([first, padded[width:] - padded[:-width]])) / width)


def running_median(series: Floats, width: int) -> Floats:
    """Median of the `width` samples about each sample, (N,); `width` is odd. The ends mirror the series.

    So an end value is in its window once: repeated, it would be its own median.
    """
    middle = width // 2
    windows = sliding_window_view(np.pad(series, middle, mode="reflect"), width)
    parts = np.array_split(windows, -(-series.size // _AT_ONCE))
    return np.concatenate([np.partition(part, middle, axis=1)[:, middle] for part in parts])
