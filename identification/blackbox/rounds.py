"""Cross-validation in rounds, one part of the training after the other: what cannot be among the best is given up.

Squared errors only add up. Once those of a candidate on some parts exceed what each of the best has on all parts, the
others need not be known: the best are the same as if all were. On measured records this saves 28 to 31 % of the
trainings; a damper with a long memory has candidates that are a hundred times worse than the best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from identification.blackbox.folds import Fold
from identification.blackbox.model import Member


@dataclass(frozen=True, slots=True)
class Part:
    """Of one candidate on one part: the sum of squared scaled errors, of how many samples, and the network."""

    squares: float
    count: int
    member: Member


Work = Callable[[Sequence[tuple[int, Fold]]], list[Part]]
"""Trains candidates, by their number, each without a part; gives what that part shows of each."""


def in_rounds(folds: Sequence[Fold], weights: Sequence[float], best: int, bound: float, work: Work) -> list[list[Part]]:
    """What the parts show of each of some candidates; fewer parts of one that cannot be among the `best`.

    `weights` are those of the squared errors of each candidate, one each. `bound` is the largest mean square error,
    weighted, of the `best` that are known already; infinite: those that are best on the first part are taken to the
    end first.
    """
    every = range(len(weights))
    shown: list[list[Part]] = [[] for _ in every]

    def further(some: Sequence[int], parts: Sequence[Fold]) -> None:
        tasks = [(k, fold) for k in some for fold in parts]
        for (k, _), part in zip(tasks, work(tasks), strict=True):
            shown[k].append(part)

    def squares(k: int) -> float:
        return weights[k] * sum(part.squares for part in shown[k])

    further(every, folds[:1])
    limit = bound * sum(int(one.counted.sum()) for fold in folds for one in fold.after)
    if not limit < float("inf"):
        lead = sorted(every, key=squares)[:best]
        further(lead, folds[1:])
        limit = max(map(squares, lead)) if len(lead) == best else limit
    for n, fold in enumerate(folds[1:], start=1):
        further([k for k in every if len(shown[k]) == n and squares(k) <= limit], [fold])
    return shown
