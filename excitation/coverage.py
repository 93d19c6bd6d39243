"""How evenly samples fill the box they reach, or a region that is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_within
from excitation.errors import DesignError
from excitation.region import Region

__all__ = ["Coverage", "coverage", "coverage_within", "cumulative_distribution"]

_ROUNDING = 1e-9  # of half a range: a sample that rounding moved past the edge lies on it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coverage:
    """Samples counted in cells of equal size: of the box that they reach, or of a region."""

    counts: NDArray[np.int64]  # one axis per variable
    edges: tuple[NDArray[np.float64], ...]  # of the cells, one more than cells on each axis
    outside: int = 0  # samples outside the region

    @property
    def index(self) -> float:
        """D = 100·(K/N²)·Σ(n_cell − N/K)² = 100·χ²/N, percent.

        χ² = Σ(n_cell − N/K)²/(N/K) is Pearson's statistic of equal filling, so that κ = K/N². It is the squared
        relative deviation of the cells' filling from the mean filling: 0 is uniform. It tends to a value that depends
        only on the distribution as N grows (N independent uniform samples give 100·(K − 1)/N) and the cells shrink.
        """
        cells, samples = self.counts.size, int(self.counts.sum()) + self.outside
        deviation = self.counts - samples / cells
        return float(100.0 * cells * np.sum(deviation * deviation) / samples**2)

    @property
    def normalised(self) -> float:
        """D/(K − 1): 100 when all samples fall into one cell, percent."""
        return self.index / (self.counts.size - 1)


def coverage(variables: Sequence[NDArray[np.float64]], grid: Sequence[int]) -> Coverage:
    """Counts the samples of one to three variables, each (N,), over ``grid`` cells of the box that they
    reach.

    Raises DesignError where shapes do not fit or a variable is constant.
    """
    if len(variables) != len(grid) or not 1 <= len(grid) <= 3:
        raise DesignError(f"grid is {list(grid)}: it needs one number of cells for each of {len(variables)} variables")
    for cells in grid:
        check_within("grid", cells, 2, 100_000)
    edges = tuple(_edges(values, cells) for values, cells in zip(variables, grid, strict=True))
    return Coverage(counts=_counts(variables, edges), edges=edges)


def coverage_within(region: Region, variables: Sequence[NDArray[np.float64]], grid: Sequence[int]) -> Coverage:
    """Counts the samples of the region's variables, each (N,), over ``grid`` cells of equal area of the region.

    Samples outside belong to no cell, and count as samples: they raise the index. The edges are those in the square
    that ``Region.square`` maps to.
    """
    square = region.square(variables)
    inside = np.ones(square[0].size, dtype=bool)
    for values in square:
        inside &= np.abs(values) <= 1.0 + _ROUNDING
    edges = tuple(np.linspace(-1.0, 1.0, cells + 1) for cells in grid)
    counts = _counts([values[inside] for values in square], edges)
    return Coverage(counts=counts, edges=edges, outside=int(inside.size - inside.sum()))


def _counts(variables: Sequence[NDArray[np.float64]], edges: Sequence[NDArray[np.float64]]) -> NDArray[np.int64]:
    grid = tuple(axis.size - 1 for axis in edges)
    index = np.zeros(variables[0].size, dtype=np.int64)
    for values, axis in zip(variables, edges, strict=True):
        index = index * (axis.size - 1) + _cell(values, axis)
    return np.bincount(index, minlength=int(np.prod(grid))).reshape(grid).astype(np.int64)


def _edges(values: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    low, high = float(values.min()), float(values.max())
    if not low < high:
        raise DesignError(f"a variable is constant ({low:g}): a range cannot be covered without motion along it")
    return np.linspace(low, high, cells + 1)


def _cell(values: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.int64]:
    cells = edges.size - 1
    place = (values - edges[0]) * (cells / (edges[-1] - edges[0]))
    return np.asarray(np.minimum(place.astype(np.int64), cells - 1))


def cumulative_distribution(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The values in ascending order, (N,), and the share of samples at or below each, (N,) in (0, 1]."""
    ordered = np.sort(values)
    return ordered, np.arange(1, ordered.size + 1) / ordered.size
