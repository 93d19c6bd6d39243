"""Names in outcomes that were kept before the features of every judged name were."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from types import SimpleNamespace

from benchmarks.explain.judge import Outcome
from identification.discrepancy.confidence import Features
from identification.discrepancy.trials import allowance, complexity
from identification.physical.elements import CATALOGUE

_RUNS = 6  # of every campaign without conditions of its own


@dataclass(frozen=True, slots=True)
class _Tried:
    """A trial as far as it was kept: what the allowance and the complexity of a trial ask for."""

    name: str
    excess: float
    contribution: float
    parameters: int
    closed: float

    @property
    def own(self) -> SimpleNamespace:
        return SimpleNamespace(spec=CATALOGUE[self.name])

    @property
    def fit(self) -> SimpleNamespace:
        return SimpleNamespace(samples=0)


def features_of_latest(o: Outcome) -> tuple[str, Features] | None:
    """The name that was added last and its features; None where a later step of the search has changed them.

    What was not kept is taken as follows: all runs see the name, and the base has a curve over velocity, as every
    machine of the generator has.
    """
    move = o.get("moves", [None])[-1] if o.get("moves") else None
    if move is None or move["kind"] != "add" or move["name"] not in o.get("evidence", {}):
        return None
    name, kept = move["name"], o["evidence"][move["name"]]
    tried = [_Tried(n, e, c, p, max(move["before"] - e, 0.0)) for n, e, c, p, _ in move["rivals"]]
    chosen = next(t for t in tried if t.name == name)
    spec = CATALOGUE[name]
    return name, Features(
        spread=kept["spread"], runs=_RUNS, left_beside=max(move["after"], 0.0) / move["before"],
        margin=min((_margin(chosen, t) for t in tried if t.name not in o["names"]), default=inf),
        own_share=kept["own_share"], beside_curve=spec.bent,
    )  # fmt: skip


def _margin(chosen: _Tried, other: _Tried) -> float:
    worse = max(other.excess - chosen.excess, 0.0) / allowance(chosen, other)
    better = min(max(chosen.excess - other.excess, 0.0) / allowance(other, chosen), 1.0)
    return worse - better + max(complexity(other) - complexity(chosen), 0.0)
