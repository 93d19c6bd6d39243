"""Where a displacement rests, seen in its samples as they were measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE

Floats = NDArray[np.float64]

_AT_REST = 6.0  # times its noise a displacement strays from where it rests: by chance one sample of 5·10⁸ does so more
# Samples of a rest. Of the span of 12σ that it may have noise takes 5σ; a turning point that takes the other 7σ is in
# its middle third 0.44 of that higher than beside it: more than five sigmas of this difference from 16 samples on.
_SHORTEST = 25
_SHORTENED = 8  # one part of so many of a stretch that is no rest, before it is looked at again: at most that is lost


def resting(x: Floats, noise: float, creep: float, least: int) -> NDArray[np.bool_]:
    """Where a displacement (N,), m, with white noise, m rms, stays within that for `least` samples or more, (N,).

    A rest may creep by `creep` a sample. A turning point or a slow ramp moves beyond noise and creep from one part of
    its stretch to the next. A filtered velocity tells none of this: it rings beside corners and where a motion ends.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # 0.2 s to import: only where no record repeats

    least = max(least, _SHORTEST)
    close, rests, start = 2.0 * _AT_REST * noise, np.zeros(x.size, dtype=bool), 0
    spans = [one(x, least, origin=-(least // 2)) for one in (maximum_filter1d, minimum_filter1d)]  # from each sample on
    quiet = np.flatnonzero((spans[0] - spans[1])[: x.size - least + 1] <= close + creep * least)
    while (k := int(np.searchsorted(quiet, start))) < quiet.size:
        start = int(quiet[k])
        stop = start + _stays(x[start:], close, creep, least)
        if _is_level(x[start:stop], noise, creep):
            rests[start:stop] = True
            start = stop
        else:  # a rest may begin within it
            start += max(least // 2, (stop - start) // _SHORTENED)
    return rests


def _stays(x: Floats, close: float, creep: float, least: int) -> int:
    """For how many samples from its first a displacement stays as close together as a rest."""
    size = least
    while True:
        size = min(2 * size, x.size)
        span = np.maximum.accumulate(x[:size]) - np.minimum.accumulate(x[:size])
        far = np.flatnonzero(span > close + creep * np.arange(1, size + 1))
        far = far[far >= least]
        if far.size or size == x.size:
            return int(far[0]) if far.size else size


def _is_level(x: Floats, noise: float, creep: float) -> bool:
    """Whether the means of three parts of a stretch differ by no more than noise and creep may make them."""
    means = [float(np.mean(part)) for part in np.array_split(x, 3)]
    return max(means) - min(means) <= CHANCE.sigmas * noise * float(np.sqrt(6.0 / x.size)) + creep * x.size
