"""The shuffled frog-leaping algorithm of Eusuff & Lansey (2003): a search that needs no gradient."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaping:
    """Settings of the search: `memeplexes` of `frogs` each, of which `parents` take part in each of `leaps`."""

    memeplexes: int = 6
    frogs: int = 8
    parents: int = 6
    leaps: int = 8
    largest_leap: float = 0.6  # of the range of each parameter


@dataclass(frozen=True, slots=True)
class Found:
    """The best point (K,), its cost, and the number of evaluations."""

    place: Floats
    cost: float
    evaluations: int


def frog_leaping(
    cost: Callable[[Floats], float],
    low: Floats,
    high: Floats,
    *,
    evaluations: int,
    seed: int = 0,
    how: Leaping | None = None,
) -> Found:
    """The lowest cost within a box, (K,) `low` to `high`, by about `evaluations` evaluations.

    All frogs are ranked and distributed to the memeplexes in turn. In each, parents are drawn with probabilities that
    fall linearly with rank; the worst of them leaps by a random share of the way towards the best of them, else towards
    the best of all, else to a random place. After some leaps all are shuffled together.
    """
    how, rng = how or Leaping(), np.random.default_rng(seed)
    count, size = how.memeplexes * how.frogs, low.size
    ponds = low + (high - low) * rng.random((count, size))
    costs = np.array([cost(frog) for frog in ponds])
    used = count
    chance = 2.0 * (how.frogs - np.arange(how.frogs)) / (how.frogs * (how.frogs + 1))
    while used < evaluations:
        order = np.argsort(costs)
        ponds, costs = ponds[order], costs[order]
        best = ponds[0].copy()
        for memeplex in range(how.memeplexes):
            mine = np.arange(memeplex, count, how.memeplexes)
            for _ in range(how.leaps):
                mine = mine[np.argsort(costs[mine])]
                chosen = np.sort(rng.choice(how.frogs, how.parents, replace=False, p=chance))
                worst = mine[chosen[-1]]
                for towards in (ponds[mine[chosen[0]]], best, None):
                    place = _leap(ponds[worst], towards, low, high, how.largest_leap, rng)
                    reached = cost(place)
                    used += 1
                    if reached < costs[worst] or towards is None:
                        break
                ponds[worst], costs[worst] = place, reached
            if used >= evaluations:
                break
    k = int(np.argmin(costs))
    return Found(ponds[k], float(costs[k]), used)


def _leap(
    frog: Floats, towards: Floats | None, low: Floats, high: Floats, most: float, rng: np.random.Generator
) -> Floats:
    if towards is None:
        return np.asarray(low + (high - low) * rng.random(low.size))
    reach = most * (high - low)
    return np.asarray(np.clip(frog + np.clip(rng.random() * (towards - frog), -reach, reach), low, high))
