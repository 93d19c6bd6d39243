"""What an exploration found: deviations of every sample from every test, the feasible set, and what limits it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.studies.exploration.asked import Exploration
from identification.studies.exploration.sine_tests import SineTest

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

CRITERIA = ("dynamic stiffness", "loss angle", "loop shape")


@dataclass(frozen=True, slots=True, kw_only=True)
class Explored:
    """The samples (S, K) of the K varied parameters, SI, and the figures (S, T, 3) of each over each test."""

    model: str
    asked: Exploration
    names: tuple[str, ...]
    start: Floats  # (K,)
    samples: Floats
    figures: Floats
    tests: tuple[SineTest, ...]
    left_out: tuple[str, ...] = ()

    @property
    def measured(self) -> Floats:
        """The figures of the tests, (T, 3)."""
        return np.stack([test.measured for test in self.tests])

    @property
    def worst(self) -> Floats:
        """Greatest deviation of each sample over the tests as a share of the measured, (S, 3); inf where it failed."""
        apart = np.abs(self.figures / self.measured - 1.0)
        return np.asarray(np.where(np.isnan(apart), np.inf, apart).max(axis=1))

    @property
    def within(self) -> Mask:
        """Whether each sample keeps each limit on every test, (S, 3)."""
        return np.asarray(self.worst <= self.asked.limits.row())

    @property
    def feasible(self) -> Mask:
        """Whether each sample keeps every limit, (S,)."""
        return np.asarray(self.within.all(axis=1))

    def reached(self) -> Floats | None:
        """Greatest deviation within the feasible set by criterion, (3,); None where it is empty."""
        return self.worst[self.feasible].max(axis=0) if self.feasible.any() else None

    def binding(self) -> int:
        """The criterion whose limit shapes the set: the most samples would join it without that limit.

        Where none joins without one limit alone, that which the nearest sample exceeds most. Nearest: its worst
        deviation, as a share of the limit, is the least.
        """
        joined = self.without_limit() - int(self.feasible.sum())
        if joined.max() > 0:
            return int(np.argmax(joined))
        reached = self.reached()
        share = self.worst[self.nearest()] if reached is None else reached
        return int(np.argmax(share / self.asked.limits.row()))

    def nearest(self) -> int:
        """The sample whose worst deviation, as a share of its limit, is the least."""
        return int(np.argmin((self.worst / self.asked.limits.row()).max(axis=1)))

    def without_limit(self) -> NDArray[np.int64]:
        """How many samples would be feasible without each limit, (3,)."""
        others = [np.delete(self.within, k, axis=1).all(axis=1).sum() for k in range(len(CRITERIA))]
        return np.array(others, dtype=np.int64)

    def worst_test(self, criterion: int, sample: int) -> SineTest:
        """The test in which a sample deviates most."""
        apart = np.abs(self.figures[sample, :, criterion] / self.measured[:, criterion] - 1.0)
        return self.tests[int(np.argmax(np.where(np.isnan(apart), np.inf, apart)))]

    def correlations(self) -> Floats | None:
        """Rank correlation (Spearman) of the parameters within the feasible set, (K, K); None under three samples."""
        return ranked(self.samples[self.feasible])

    def effects(self) -> Floats:
        """Rank correlation of each parameter with each criterion's worst deviation over all samples, (K, 3)."""
        k = len(self.names)
        both = ranked(np.column_stack([self.samples, self.worst]))
        return np.zeros((k, len(CRITERIA))) if both is None else both[:k, k:]


def ranked(columns: Floats) -> Floats | None:
    """Spearman's rank correlation of columns (N, K), (K, K); 0 for a constant one; None under three rows."""
    if len(columns) < 3:
        return None
    from scipy.stats import rankdata  # 0.3 s to import: only where it is needed

    ranks = rankdata(columns, axis=0)
    ranks = ranks - ranks.mean(axis=0)
    size = np.sqrt(np.sum(ranks**2, axis=0))
    size[size == 0.0] = np.inf
    return np.asarray((ranks / size).T @ (ranks / size))


def figure_names() -> Sequence[str]:
    """The figures with their units."""
    return ("dynamic stiffness, N/m", "loss angle, °", "loop shape")
