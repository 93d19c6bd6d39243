"""Mean, median and maximum of a series in a window that slides along it.

They are those of `uniform_filter1d`, `median_filter` and `maximum_filter1d` of `scipy.ndimage`, to the bit: every
periodic record needs them, and that package takes 0.2 s to import.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

__all__ = ["running_maximum", "running_mean", "running_median"]

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


def running_maximum(series: Floats, reach: int) -> Floats:
    """The highest of the samples within `reach` of each, (N,), and of zero beyond the ends.

    Compared are windows of 1, 2, 4 … samples, and at last two that overlap.
    """
    width, span = 2 * reach + 1, 1
    highest = np.pad(series, reach)
    while 2 * span <= width:
        highest = np.maximum(highest[:-span], highest[span:])
        span *= 2
    return np.asarray(np.maximum(highest[: series.size], highest[highest.size - series.size :]))
