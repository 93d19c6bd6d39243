"""Where a training went, some signals taken together: each may lie within its range and their combination be new.

A reversal where the training has none, a rest where it never rested, a current between two: no part that is left out in
cross-validation shows what a black box does there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.motion import LARGEST_INPUT, Motion
from identification.signals import SIGNALS

Floats = NDArray[np.float64]

TOGETHER = ("displacement", "velocity", "current")
"""Signals that are taken together, as far as a model sees them."""

# Distance from the nearest sample of the training, of the range of each signal there. Of 63 cuts of one record each 31
# have such samples; half: 43; double: 10, and a rest of 16 % of a record that no training has is not among them.
FAR = 0.1

# Side of the cells of which one sample each is kept, of the range of each signal: a distance is told as too large by
# its diagonal at most, 0.03 in two and three signals. Half: four times the points; double: a tenth told for a twelfth.
CELL = 0.02

# Points that are kept: of a model file of some 60 kB a third. Where there are more, the cells grow.
MOST_POINTS = 2_000
_GROWN = 1.25  # times the side of a cell, until the points are no more than that
STEPS = 1_000
"""Of a range: a point is kept to so many."""

_LEAST_SPAN = 1e-12  # SI: a signal that moves by less is frozen


@dataclass(frozen=True, slots=True)
class Visited:
    """Samples of a training to one of which all others are near, (K, D), as shares 0 … 1 of the range of each signal.

    `limits` are the lowest and the highest value of each of the D signals in the training, SI.
    """

    limits: Mapping[str, tuple[float, float]]
    points: Floats = field(compare=False)

    def __post_init__(self) -> None:
        foreign = set(self.limits) - set(TOGETHER)
        if foreign or len(self.limits) < 2:
            raise ModelError(f"together is of {', '.join(self.limits) or 'nothing'}: two or more of {TOGETHER}")
        for signal, (low, high) in self.limits.items():
            if not -LARGEST_INPUT <= low <= high - _LEAST_SPAN <= LARGEST_INPUT:
                raise ModelError(
                    f"together.{signal} is [{low:g}, {high:g}]: two numbers within ±{LARGEST_INPUT:g}, the lower first"
                )
        shape = self.points.shape
        if len(shape) != 2 or shape[1] != len(self.limits) or not 1 <= shape[0] <= MOST_POINTS:
            raise ModelError(f"together.points is of the shape {shape}: 1 … {MOST_POINTS} points of {len(self.limits)}")
        if not (np.all(self.points >= 0.0) and np.all(self.points <= 1.0)):
            raise ModelError("together.points must lie within the range of every signal")

    def distances(self, motion: Motion) -> Floats:
        """From each sample of a motion to the nearest point, of the range of each signal, (N,)."""
        return self._nearest(_shares(motion, self.limits))

    def away(self, motion: Motion) -> tuple[Floats, Floats]:
        """How far each sample is from the training, of the ranges: within them, and past them, each (N,).

        Within them it is the distance of what is cut at their edges from the nearest point, less what a sample of the
        training itself may have: the diagonal of a cell of `CELL`; a hundredth more where cells had to grow.
        """
        shares = _shares(motion, self.limits)
        cut = np.clip(shares, 0.0, 1.0)
        apart = np.maximum(self._nearest(cut) - CELL * np.sqrt(len(self.limits)), 0.0)
        return np.asarray(apart), np.asarray(np.linalg.norm(shares - cut, axis=1))

    def _nearest(self, shares: Floats) -> Floats:
        from scipy.spatial import cKDTree  # 0.1 s to import: only where a run is simulated

        return np.asarray(cKDTree(self.points).query(shares)[0])

    def described(self, motion: Motion) -> list[str]:
        """A sentence where samples lie far from all of the training: how many, where first, and how far; or none."""
        distances = self.distances(motion)
        far = distances > FAR
        if not far.any():
            return []
        *others, last = self.limits
        first, farthest = (int(np.argmax(one)) for one in (far, distances))
        return [
            f"{100.0 * np.mean(far):.3g} % of the samples lie more than {100.0 * FAR:g} % of the trained range from "
            f"all of the training, {', '.join(others)} and {last} taken together, first at {first * motion.dt:.4g} s, "
            f"farthest at {farthest * motion.dt:.4g} s by {100.0 * distances[farthest]:.2g} %"
        ]


def visited_in(motions: Sequence[tuple[Motion, NDArray[np.bool_]]], signals: Sequence[str]) -> Visited | None:
    """Where some motions went in the samples that count; None where fewer than two of the signals vary."""
    ranges = {}
    for signal in signals:
        values = np.concatenate([getattr(one, SIGNALS[signal])[counted] for one, counted in motions])
        low, high = float(np.min(values)), float(np.max(values))
        if low <= high - _LEAST_SPAN:
            ranges[signal] = (low, high)
    if len(ranges) < 2:
        return None
    shares = np.concatenate([_shares(one, ranges)[counted] for one, counted in motions])
    return Visited(ranges, np.round(_thinned(shares) * STEPS) / STEPS)


def _shares(motion: Motion, limits: Mapping[str, tuple[float, float]]) -> Floats:
    held = motion.held()
    columns = [(getattr(held, SIGNALS[one]) - low) / (high - low) for one, (low, high) in limits.items()]
    return np.column_stack(columns)


def _thinned(shares: Floats) -> Floats:
    """The first row in each cell of a grid, of which no more than `MOST_POINTS` are occupied."""
    side = CELL
    while True:
        first = np.unique(np.floor(shares / side).astype(np.int64), axis=0, return_index=True)[1]
        if first.size <= MOST_POINTS:
            return shares[np.sort(first)]
        side *= _GROWN
