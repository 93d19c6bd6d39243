"""Skew between channels: a sensor's chain that is slower than another's, as whole racks of them are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim_rig.errors import SkewError

CHANNELS = ("force", "displacement", "current", "temperature", "pressure")
MOST_S = 0.02
_NODES = 4  # of the polynomial through the last samples


def skew_order(text: str) -> tuple[int, float]:
    """Channel and delay, s, of an order such as ``force=0.0005``.

    Raises SkewError for a channel that does not exist or a delay outside 0 … 0.02 s.
    """
    name, _, delay = text.partition("=")
    try:
        seconds = float(delay)
    except ValueError:
        seconds = -1.0
    if name not in CHANNELS or not 0.0 <= seconds <= MOST_S:
        raise SkewError(f"skew '{text}': write CHANNEL=SECONDS with one of {', '.join(CHANNELS)} and 0 … {MOST_S:g} s")
    return CHANNELS.index(name), seconds


class Skew:
    """Delays of the channels; remembers as many samples as the longest needs.

    A delay between samples is a cubic through the four that have come: exact for slow motion, with no look ahead.
    """

    def __init__(self, orders: Sequence[str] = ()) -> None:
        self._delays = np.zeros(len(CHANNELS))
        for text in orders:
            channel, seconds = skew_order(text)
            self._delays[channel] = seconds
        self.past: NDArray[np.float64] | None = None  # the last samples, once there are some

    def late(self, truth: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
        """The rows (n, 5) as the delayed channels show them at each instant."""
        if not np.any(self._delays) or truth.shape[0] == 0:
            return truth
        reach = int(np.max(self._delays) * rate_hz) + _NODES
        past = self.past if self.past is not None and self.past.shape[0] == reach else np.tile(truth[:1], (reach, 1))
        rows = np.concatenate([past, truth])
        self.past = rows[-reach:]
        out = truth.copy()
        for channel in np.flatnonzero(self._delays):
            whole, part = divmod(float(self._delays[channel]) * rate_hz, 1.0)
            at = np.arange(reach, rows.shape[0]) - int(whole)
            out[:, channel] = sum(w * rows[at - k, channel] for k, w in enumerate(_lagrange(part)))
        return out


def _lagrange(part: float) -> list[float]:
    """Weights of the samples 0, 1, 2, 3 before for a delay of `part` of a sample."""
    nodes = range(_NODES)
    return [float(np.prod([(part - m) / (k - m) for m in nodes if m != k])) for k in nodes]
