"""The band of a black box, calibrated on what was left out of its training in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.band import HIGHEST, LEVEL, LOWEST, check_level
from identification.models.simulation import LARGEST_FORCE

Floats = NDArray[np.float64]

LEVELS = (LOWEST, 0.6, 0.7, 0.8, 0.85, LEVEL, 0.95, 0.975, HIGHEST)
"""Levels whose factors are kept; between them they are interpolated."""


@dataclass(frozen=True, slots=True)
class Band:
    """Half-width = factor(level)·√(floor² + s² + o²): s is the spread of the members at a sample, N, and o what the
    model adds to its force there because an input lies outside of the training, N (see `outside`).

    `floor`, N, is the rms error in cross-validation; the factors are quantiles of |e|/√(floor² + s²) there: conformal
    prediction with normalised errors (Papadopoulos, Gammerman and Vovk 2008; across folds as in the CV+ of Barber,
    Candès, Ramdas and Tibshirani 2021). Their guarantee is for errors that could be exchanged. Those of one run are
    not independent: the level holds over many runs of the kind of the training, not for each.
    """

    floor: float
    factors: tuple[float, ...]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.floor) and self.floor > 0.0):
            raise ModelError(f"band.floor is {self.floor:g} N: it must be above 0")
        if len(self.factors) != len(LEVELS):
            raise ModelError(f"band.factors has {len(self.factors)} entries: one for each of {len(LEVELS)} levels")
        if not np.all(np.isfinite(self.factors)) or self.factors[0] < 0.0 or np.any(np.diff(self.factors) < 0.0):
            raise ModelError("band.factors must be finite, not negative, and rise with the level")
        if max(self.floor, *self.factors) > LARGEST_FORCE:
            raise ModelError(f"band: floor and factors must lie below {LARGEST_FORCE:g}: no machine has such a force")

    def half_width(self, spread: Floats, level: float, outside: Floats | float = 0.0) -> Floats:
        """Half-width at each sample, (N,), N; raises DataError for a level that is not kept."""
        check_level(level)
        factor = float(np.interp(level, LEVELS, self.factors))
        return np.asarray(factor * np.hypot(np.hypot(self.floor, spread), outside))


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What a part that was not learned from showed: errors and spreads, each (N,), N."""

    errors: Floats
    spreads: Floats


def band_of(parts: Sequence[LeftOut]) -> Band:
    """The band of what was left out in turn."""
    floor = float(np.sqrt(np.mean(np.concatenate([one.errors for one in parts]) ** 2)))
    scores = np.sort(np.concatenate([_scores(one, floor) for one in parts]))
    # The quantile of n scores that a further one stays below with the stated probability.
    ranks = np.minimum(np.ceil(np.array(LEVELS) * (scores.size + 1)).astype(np.int64), scores.size) - 1
    return Band(floor, tuple(float(one) for one in scores[ranks]))


def coverage_of(parts: Sequence[LeftOut], level: float = LEVEL) -> float:
    """The share of each part within the band of the others, on average over all samples: what to expect of new runs."""
    held = [
        np.abs(one.errors) <= band_of(_without(parts, k)).half_width(one.spreads, level) for k, one in enumerate(parts)
    ]
    return float(np.mean(np.concatenate(held)))


def _without(parts: Sequence[LeftOut], k: int) -> list[LeftOut]:
    return [one for n, one in enumerate(parts) if n != k]


def _scores(part: LeftOut, floor: float) -> Floats:
    return np.asarray(np.abs(part.errors) / np.hypot(floor, part.spreads))
