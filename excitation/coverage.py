"""How evenly samples fill the box they reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_within
from excitation.errors import DesignError

__all__ = ["Coverage", "coverage", "cumulative_distribution"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coverage:
    """Samples counted in the cells of the box from the smallest to the largest value on each axis."""

    counts: NDArray[np.int64]  # one axis per variable
    edges: tuple[NDArray[np.float64], ...]  # of the cells, one more than cells on each axis

    @property
    def index(self) -> float:
        """D = 100·(K/N²)·Σ(n_cell − N/K)², percent.

        The squared relative deviation of the cells' filling from the mean filling: 0 is uniform. It tends to
        a value that depends only on the distribution as N grows (N independent uniform samples give 100·(K −
        1)/N) and the cells shrink.
        """
        cells, samples = self.counts.size, int(self.counts.sum())
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
    index = np.zeros(variables[0].size, dtype=np.int64)
    edges = []
    for values, cells in zip(variables, grid, strict=True):
        axis = _edges(values, cells)
        index = index * cells + _cell(values, axis)
        edges.append(axis)
    counts = np.bincount(index, minlength=int(np.prod(grid)))
    return Coverage(counts=counts.reshape(tuple(grid)).astype(np.int64), edges=tuple(edges))


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
