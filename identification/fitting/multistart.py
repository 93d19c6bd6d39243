"""Fits from several starts, because the answer may depend on the start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.compute import run
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records, free_parameters
from identification.physical.model import Model
from identification.record import Record, compact

Floats = NDArray[np.float64]

_COARSE_STEPS = 12
_SAME = 1.02  # cost over the best: the same minimum


@dataclass(frozen=True, slots=True, kw_only=True)
class ManyFits:
    """The best fit, the cost of each start (infinite: it failed), and how many starts reached the best minimum."""

    best: Fit
    costs: tuple[float, ...]
    met: int


def starts(model: Model, free: NDArray[np.bool_], count: int, *, spread: float = 3.0, seed: int = 0) -> list[Model]:
    """The model itself and `count` − 1 others, each free parameter times a factor in 1/spread … spread.

    The factors are a Latin hypercube on a logarithmic scale; a parameter that is zero stays, none leaves its bounds.
    """
    low, high = model.bounds()
    values = model.values()
    from scipy.stats import qmc  # its import takes half of the start of a command, and few need it

    draws = qmc.LatinHypercube(d=int(free.sum()), rng=np.random.default_rng(seed)).random(max(count - 1, 0))
    models = [model]
    for draw in draws:
        factors = np.ones(values.size)
        factors[free] = spread ** (2.0 * draw - 1.0)
        models.append(model.with_values(np.clip(values * factors, low, high)))
    return models


def fit_from_many(
    model: Model,
    records: Sequence[Record],
    count: int,
    *,
    spread: float = 3.0,
    seed: int = 0,
    robust: float | None = None,
    on_start: Callable[[int], None] | None = None,
) -> ManyFits:
    """Some steps from every start on the mean periods, then the whole fit from the best of them.

    Raises SimulationError where the model diverges from every start.
    """
    free = free_parameters(model, records)
    small = [compact(r) for r in records]
    many = starts(model, free, count, spread=spread, seed=seed)
    tell = None if on_start is None else lambda done, _: on_start(done)
    tried = run(partial(_tried, records=small, robust=robust), many, on_done=tell)
    best = min(tried, key=lambda pair: pair[0])
    costs = tuple(cost for cost, _ in tried)
    fit = fit_records(best[1], records, robust=robust)
    return ManyFits(best=fit, costs=costs, met=sum(cost <= _SAME * best[0] for cost in costs))


def _tried(start: Model, records: Sequence[Record], robust: float | None) -> tuple[float, Model]:
    """Cost and model of one start after a few steps; an infinite cost where it diverges."""
    try:
        found = fit_records(start, records, max_iterations=_COARSE_STEPS, tolerance=1e-3, robust=robust)
    except SimulationError:
        return np.inf, start
    return found.chi2, found.model
