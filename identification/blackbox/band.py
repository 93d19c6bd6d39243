"""The band of a black box, calibrated on what was left out of its training in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from identification.errors import ModelError
from identification.models.band import HIGHEST, LEVEL, LOWEST, check_level
from identification.models.simulation import LARGEST_FORCE

Floats = NDArray[np.float64]

LEVELS = (LOWEST, 0.6, 0.7, 0.8, 0.85, LEVEL, 0.95, 0.975, HIGHEST)
"""Levels whose factors are kept; between them they are interpolated."""

MOST_GROWTH = 1.0
"""At 1 the error is proportional to the force beyond its usual swing: it grows no faster."""

MOST_WEIGHT = 32.0
"""Of a distance from the training: a tenth of the range away the force is then unknown by 3.2 of its rms."""

# Growths that are tried: the width at twice the usual swing differs by 7 % between neighbours at most. Half or double
# as many: nothing.
_GROWTHS = np.linspace(0.0, MOST_GROWTH, 21)

# The weights of the distances before anything is left out: log₂ of each has this mean and a standard deviation of one.
# A force that is in proportion to a signal changes by √12 of its rms over the range: what a model says of that is taken
# to be wrong by a seventh within the ranges, and by a third beyond, where it has nothing on the other side.
# Bands of 90 % of 12 trainings that show a current between theirs (UTFSM, mlp; without the factor of few runs),
# interval score (Winkler 1972, in errors of cross-validation; lower is better) and share held: 1.47 and 98 % with
# weights of 1 that were not calibrated; with half of `_WITHIN` 0.99 and 96, with this 1.03 and 96, with its double 1.14
# and 97. Of 8 that show one beyond: 2.97 and 94 %; with half of `_BEYOND` 2.29 and 88, with this 2.62 and 95, with its
# double 3.77 and 99.
_WITHIN, _BEYOND = 0.5, 1.0

_WEIGHTS = 2.0 ** np.arange(-5, 6)  # that are tried: four octaves or more on each side of the usual ones
_COARSE = 4  # every so many growths are tried with each pair of weights
_SEEN = 2_000  # samples that growth and weights are chosen on: half or double: nothing
_LEAST_SWING = 1e-12  # N: that of a channel that is frozen


@dataclass(frozen=True, slots=True)
class Band:
    """Half-width = factor(level)·√(floor²·w + s² + a² + swing²·((within·d)² + (beyond·b)²)), N.

    s is the spread of the members at a sample, N. w = 1 + growth·(max(f/swing, 1)² − 1) where the force swings by f
    about its mean there (see `swing`), N: beyond what is usual in the training, `swing`, N, errors grow with it as far
    as those in cross-validation do. Where the motion leaves the training, a is what the model adds to its force, N, b
    how far it is beyond the ranges, and d how far from all of the training within them, both of the ranges (see
    `outside`); the weights `within` and `beyond` say how errors grow with that.

    `floor`, N, is the rms error in cross-validation; the factors are quantiles of |e| over the root there: conformal
    prediction with normalised errors (Papadopoulos, Gammerman and Vovk 2008; across folds as in the CV+ of Barber,
    Candès, Ramdas and Tibshirani 2021). Their guarantee is for errors that could be exchanged. Those of one run are
    not independent: the level holds over many runs of the kind of the training, not for each.
    """

    floor: float
    factors: tuple[float, ...]
    growth: float = 0.0
    swing: float = 1.0
    within: float = 1.0
    beyond: float = 1.0

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
        for name, weight in (("within", self.within), ("beyond", self.beyond)):
            if not 0.0 <= weight <= MOST_WEIGHT:
                raise ModelError(f"band.{name} is {weight:g}: it must lie within 0 … {MOST_WEIGHT:g}")

    def half_width(self, place: Place, level: float) -> Floats:
        """Half-width at each sample of a place, (N,), N; raises DataError for a level that is not kept."""
        check_level(level)
        return np.asarray(float(np.interp(level, LEVELS, self.factors)) * self.scale(place))

    def scale(self, place: Place) -> Floats:
        """The root at each sample, (N,), N: what the errors in cross-validation are divided by."""
        return np.asarray(np.sqrt(self._known(place) + self._unknown(place)))

    def _known(self, place: Place) -> Floats:
        more = self.growth * (np.maximum(place.swings / self.swing, 1.0) ** 2 - 1.0)
        return np.asarray(self.floor**2 * (1.0 + more) + place.spreads**2)

    def _unknown(self, place: Place) -> Floats:
        away = (self.within * place.apart) ** 2 + (self.beyond * place.past) ** 2
        return np.asarray(place.added**2 + self.swing**2 * away)


@dataclass(frozen=True, slots=True)
class Place:
    """Where some samples lie beside what was learned, each (N,): the spread of the members, the swing of the force, and
    what the model adds outside, N; the distance from all of it within the ranges, and that past the ranges, of them."""

    spreads: Floats
    swings: Floats
    added: Floats
    apart: Floats
    past: Floats

    def columns(self) -> tuple[Floats, ...]:
        """All of them, in this order."""
        return self.spreads, self.swings, self.added, self.apart, self.past


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What a part that was not learned from showed: the errors, (N,), N, and their place beside what was learned.

    `runs` is of how many runs, where some of them were left out whole; 0 where all are stretches of runs that were
    learned otherwise.
    """

    errors: Floats
    place: Place
    runs: int = 0


def band_of(parts: Sequence[LeftOut]) -> Band:
    """The band of what was left out in turn.

    The errors of one run are off together. Of R runs that were left out whole, each is taken for one observation of a
    normal error whose size is unknown: that of a further one is distributed as Student's t of R − 1 degrees of freedom,
    so that the factors are larger by the ratio of its quantile to that of the normal distribution: at 90 % by 1.43
    for four runs and 1.11 for ten. Stretches of one run are of the same kind, and no run of another is promised.
    """
    whole = _together(parts)
    band = _weighted(whole, len(parts))
    scores = np.sort(np.abs(whole.errors) / band.scale(whole.place))
    # The quantile of n scores that a further one stays below with the stated probability.
    ranks = np.minimum(np.ceil(np.array(LEVELS) * (scores.size + 1)).astype(np.int64), scores.size) - 1
    factors = scores[ranks] * _of_few(sum(one.runs for one in parts))
    return replace(band, factors=tuple(float(one) for one in factors))


def _of_few(runs: int) -> Floats:
    """For each level the ratio of the quantile of Student's t, of `runs` − 1 degrees of freedom, to the normal one."""
    two_sided = 0.5 + 0.5 * np.array(LEVELS)
    return np.asarray(stdtrit(max(runs - 1, 1), two_sided) / ndtri(two_sided)) if runs else np.ones(len(LEVELS))


def _together(parts: Sequence[LeftOut]) -> LeftOut:
    place = zip(*(one.place.columns() for one in parts), strict=True)
    return LeftOut(np.concatenate([one.errors for one in parts]), Place(*map(np.concatenate, place)))


def _weighted(whole: LeftOut, parts: int) -> Band:
    """A band whose factors are not known yet: with the weights of the distances that the parts make likely, and the
    growth at which normal errors of its size are then most likely.

    The errors of one part are off together, so that each part is one observation of the weights, however many samples
    it has: p(within, beyond) ∝ L^(parts/N)·n(log₂ within/`_WITHIN`)·n(log₂ beyond/`_BEYOND`), L the likelihood of the
    N errors at the best growth, n the standard normal density. The mean of the square of each weight over that is kept:
    what is to be expected of a further part. Where no part lay far from what was learned, the roots are 0.8 and 1.6.
    """
    floor = float(np.sqrt(np.mean(whole.errors**2)))
    plain = Band(
        floor,
        (1.0,) * len(LEVELS),
        swing=max(float(np.median(whole.place.swings)), _LEAST_SWING),
        within=0.0,
        beyond=0.0,
    )
    step = -(-whole.errors.size // _SEEN)
    squares, place = whole.errors[::step] ** 2, Place(*(one[::step] for one in whole.place.columns()))
    known = [replace(plain, growth=float(growth)).scale(place) ** 2 for growth in _GROWTHS]
    apart, past = ((plain.swing * one) ** 2 for one in (place.apart, place.past))
    surprise = np.array(
        [
            [min(_surprise(squares, one + w**2 * apart + b**2 * past) for one in known[::_COARSE]) for b in _WEIGHTS]
            for w in _WEIGHTS
        ]
    )
    unlikely = parts * surprise + np.log2(_WEIGHTS / _WITHIN)[:, None] ** 2 + np.log2(_WEIGHTS / _BEYOND) ** 2
    likely = np.exp(-0.5 * (unlikely - unlikely.min()))
    within, beyond = (likely.sum(axis=axis) @ _WEIGHTS**2 / likely.sum() for axis in (1, 0))
    grown = [_surprise(squares, one + within * apart + beyond * past) for one in known]
    return replace(
        plain,
        growth=float(_GROWTHS[int(np.argmin(grown))]),
        within=float(np.sqrt(within)),
        beyond=float(np.sqrt(beyond)),
    )


def _surprise(squares: Floats, sizes: Floats) -> float:
    """−2·log of the likelihood, for each sample, of errors of some squares, N², that are normal with some variances
    times a factor, the best one."""
    return float(np.log(np.mean(squares / sizes)) + np.mean(np.log(sizes)))


def coverage_of(parts: Sequence[LeftOut], level: float = LEVEL) -> float:
    """The share of each part within the band of the others, on average over all samples: what to expect of new runs."""
    held = [
        np.abs(one.errors) <= band_of(_without(parts, k)).half_width(one.place, level) for k, one in enumerate(parts)
    ]
    return float(np.mean(np.concatenate(held)))


def _without(parts: Sequence[LeftOut], k: int) -> list[LeftOut]:
    return [one for n, one in enumerate(parts) if n != k]
