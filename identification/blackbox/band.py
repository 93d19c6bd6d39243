"""The band of a black box, calibrated on what was left out of its training in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.band import HIGHEST, LEVEL, LOWEST, check_level
from identification.models.simulation import LARGEST_FORCE

Floats = NDArray[np.float64]

LEVELS = (LOWEST, 0.6, 0.7, 0.8, 0.85, LEVEL, 0.95, 0.975, HIGHEST)
"""Levels whose factors are kept; between them they are interpolated."""

MOST_GROWTH = 1.0
"""At 1 the error is proportional to the force beyond its usual swing: it grows no faster."""

# Growths that are tried: the width at twice the usual swing differs by 7 % between neighbours at most. Half or double
# as many: nothing.
_GROWTHS = tuple(np.linspace(0.0, MOST_GROWTH, 21).tolist())
_SEEN = 2_000  # samples that the growth is chosen on: half or double: nothing
_LEAST_SWING = 1e-12  # N: that of a channel that is frozen


@dataclass(frozen=True, slots=True)
class Band:
    """Half-width = factor(level)·√(floor²·w + s² + o²): s is the spread of the members at a sample, N, and o what no
    measurement supports of the force there, because the motion leaves the training, N (see `outside`).

    w = 1 + growth·(max(f/swing, 1)² − 1) where the force swings by f about its mean there (see `swing`), N: beyond what
    is usual in the training, `swing`, errors grow with it as far as those in cross-validation do.
    `floor`, N, is the rms error in cross-validation; the factors are quantiles of |e|/√(floor²·w + s²) there: conformal
    prediction with normalised errors (Papadopoulos, Gammerman and Vovk 2008; across folds as in the CV+ of Barber,
    Candès, Ramdas and Tibshirani 2021). Their guarantee is for errors that could be exchanged. Those of one run are
    not independent: the level holds over many runs of the kind of the training, not for each.
    """

    floor: float
    factors: tuple[float, ...]
    growth: float = 0.0
    swing: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.floor) and self.floor > 0.0):
            raise ModelError(f"band.floor is {self.floor:g} N: it must be above 0")
        if len(self.factors) != len(LEVELS):
            raise ModelError(f"band.factors has {len(self.factors)} entries: one for each of {len(LEVELS)} levels")
        if not np.all(np.isfinite(self.factors)) or self.factors[0] < 0.0 or np.any(np.diff(self.factors) < 0.0):
            raise ModelError("band.factors must be finite, not negative, and rise with the level")
        if max(self.floor, *self.factors) > LARGEST_FORCE:
            raise ModelError(f"band: floor and factors must lie below {LARGEST_FORCE:g}: no machine has such a force")
        if not 0.0 <= self.growth <= MOST_GROWTH:
            raise ModelError(f"band.growth is {self.growth:g}: it must lie within 0 … {MOST_GROWTH:g}")
        if not _LEAST_SWING <= self.swing <= LARGEST_FORCE:
            raise ModelError(f"band.swing is {self.swing:g} N: it must lie within {_LEAST_SWING:g} … {LARGEST_FORCE:g}")

    def half_width(
        self, spread: Floats, level: float, outside: Floats | float = 0.0, swings: Floats | float = 0.0
    ) -> Floats:
        """Half-width at each sample, (N,), N; raises DataError for a level that is not kept."""
        check_level(level)
        factor = float(np.interp(level, LEVELS, self.factors))
        return np.asarray(factor * np.hypot(self.scale(spread, swings), outside))

    def scale(self, spread: Floats, swings: Floats | float) -> Floats:
        """√(floor²·w + s²) at each sample, (N,), N: what the errors in cross-validation are divided by."""
        more = self.growth * (np.maximum(swings / self.swing, 1.0) ** 2 - 1.0)
        return np.asarray(np.hypot(self.floor * np.sqrt(1.0 + more), spread))


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What a part that was not learned from showed: errors, spreads and swings of the force there, each (N,), N."""

    errors: Floats
    spreads: Floats
    swings: Floats


def band_of(parts: Sequence[LeftOut]) -> Band:
    """The band of what was left out in turn."""
    errors, spreads, swings = (
        np.concatenate(every) for every in zip(*((one.errors, one.spreads, one.swings) for one in parts), strict=True)
    )
    band = _grown(errors, spreads, swings)
    scores = np.sort(np.abs(errors) / band.scale(spreads, swings))
    # The quantile of n scores that a further one stays below with the stated probability.
    ranks = np.minimum(np.ceil(np.array(LEVELS) * (scores.size + 1)).astype(np.int64), scores.size) - 1
    return replace(band, factors=tuple(float(one) for one in scores[ranks]))


def _grown(errors: Floats, spreads: Floats, swings: Floats) -> Band:
    """A band whose factors are not known yet, with the growth at which normal errors of its size are most likely."""
    floor, usual = float(np.sqrt(np.mean(errors**2))), max(float(np.median(swings)), _LEAST_SWING)
    step = -(-errors.size // _SEEN)
    errors, spreads, swings = errors[::step], spreads[::step], swings[::step]
    tried = [Band(floor, (1.0,) * len(LEVELS), growth, usual) for growth in _GROWTHS]
    sizes = [one.scale(spreads, swings) for one in tried]
    surprise = [float(np.log(np.mean((errors / size) ** 2)) + 2.0 * np.mean(np.log(size))) for size in sizes]
    return tried[int(np.argmin(surprise))]


def coverage_of(parts: Sequence[LeftOut], level: float = LEVEL) -> float:
    """The share of each part within the band of the others, on average over all samples: what to expect of new runs."""
    held = [
        np.abs(one.errors) <= band_of(_without(parts, k)).half_width(one.spreads, level, swings=one.swings)
        for k, one in enumerate(parts)
    ]
    return float(np.mean(np.concatenate(held)))


def _without(parts: Sequence[LeftOut], k: int) -> list[LeftOut]:
    return [one for n, one in enumerate(parts) if n != k]
