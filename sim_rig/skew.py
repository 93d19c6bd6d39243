"""Skew between channels: a measuring chain with a delay."""

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
    """Delays of the channels; keeps as many samples as the longest needs.

    A delay between samples is a cubic through the last four samples: exact for slow motion, and causal.
    """

    def __init__(self, orders: Sequence[str] = ()) -> None:
        self._delays = np.zeros(len(CHANNELS))
        for text in orders:
            channel, seconds = skew_order(text)
            self._delays[channel] = seconds
        self.past: NDArray[np.float64] | None = None  # the last samples, once there are some

    def late(self, truth: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
        """The samples, (n, 5), with the delays of the channels."""
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
