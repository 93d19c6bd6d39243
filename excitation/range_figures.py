"""What a design states of its coverage: over the range asked for, and over the part of it that can be achieved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage, coverage_within
from excitation.region import Region
from excitation.signal import JSON
from excitation.working_range import achievable, asked

if TYPE_CHECKING:
    from excitation.multisine import Period
    from excitation.multisine_spec import MultisineSpec

__all__ = ["even_over", "range_figures"]


def range_figures(spec: MultisineSpec, period: Period) -> Mapping[str, JSON]:
    """Coverage index of what the damper gets, percent, over both ranges, with the ranges.

    ``coverage_asked_even``: the index over the asked range of samples that fill the achievable range exactly evenly.
    """
    received = [period.received(name) for name in spec.covered_variables]
    reachable = period.aimed_at or achievable(spec, period.displacement, period.current)
    wanted = asked(spec)
    figures: dict[str, JSON] = {
        "coverage_achievable": coverage_within(reachable, received, spec.grid).index,
        "achievable_range": range_json(reachable),
    }
    if spec.response is not None:
        figures["coverage_at_damper"] = coverage(received, spec.grid).index
    if wanted is not None:
        figures |= {
            "coverage_asked": coverage_within(wanted, received, spec.grid).index,
            "coverage_asked_even": even_over(reachable, wanted, spec.grid),
            "asked_range": range_json(wanted),
        }
    return figures


def range_json(region: Region) -> dict[str, JSON]:
    """The intervals by variable, and which two fill an ellipse."""
    made: dict[str, JSON] = {
        name: [low, high] for name, low, high in zip(region.names, region.low, region.high, strict=True)
    }
    if region.pair is not None:
        made["ellipse"] = [region.names[place] for place in region.pair]
    return made


def even_over(reachable: Region, wanted: Region, grid: Sequence[int]) -> float:
    """100·K·Σ(q − 1/K)², percent: the coverage index over the cells of ``wanted`` where q is the share of the area of
    ``reachable`` in each cell.
    """
    limits = zip(wanted.low, wanted.high, grid, strict=True)
    edges = [np.linspace(low, high, cells + 1) for low, high, cells in limits]
    shares = np.ones(())
    for axis, one in enumerate(edges):
        if reachable.pair is None or axis not in reachable.pair:
            low, high = reachable.low[axis], reachable.high[axis]
            inside = np.diff(np.clip(one, low, high)) / (high - low)
            shares = shares[..., None] * inside
    if reachable.pair is not None:
        shares = _ellipse_shares(reachable, edges)[..., None] * shares
    index = 100.0 * shares.size * np.sum((shares - 1.0 / shares.size) ** 2)
    return round(float(index), 9)  # rounding leaves 1e-28 of what is even


def _ellipse_shares(region: Region, edges: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Share of the ellipse in each cell of its plane, counted on a lattice of 1 000 × 1 000 points: exact to 1e-4."""
    assert region.pair is not None
    place = (2.0 * np.arange(1000.0) + 1.0) / 1000.0 - 1.0
    x, y = (values.ravel() for values in np.meshgrid(place, place, indexing="ij"))
    disc = x * x + y * y <= 1.0
    points = []
    for unit, axis in zip((x[disc], y[disc]), region.pair, strict=True):
        low, high = region.low[axis], region.high[axis]
        points.append(0.5 * (low + high) + 0.5 * (high - low) * unit)
    counts = np.histogramdd(np.stack(points, axis=1), bins=[edges[axis] for axis in region.pair])[0]
    return np.asarray(counts / counts.sum())
