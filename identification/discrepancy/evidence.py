"""The evidence for a name: the same strength in every run, a gap that closes, a margin to every rival."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.criteria import TEXT
from identification.discrepancy.confidence import BESIDE_A_CURVE, alike_curves, belief, beside_a_curve, rival_odds
from identification.discrepancy.excess import contribution
from identification.discrepancy.naming import Search
from identification.discrepancy.strength import spread_of, strengths
from identification.record import Record


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Numbers behind one name, on the training records."""

    name: str  # id of the element
    strengths: tuple[float, ...]  # estimated run by run, 1 is the common fit; nan where a run does not excite it
    spread: float  # their scatter beyond noise
    left: float  # share of the base's gap energy that all names together leave
    confidence: float
    alternatives: tuple[tuple[str, float], ...]
    own_share: float  # of its signature: what no refit of the base could imitate


def gather(found: Search, records: Sequence[Record]) -> list[Evidence]:
    """Evidence for every name of a search, in the order in which they were found."""
    return [_evidence(found, name, records) for name in found.names]


def _evidence(found: Search, name: str, records: Sequence[Record]) -> Evidence:
    values, precision = strengths(found.fit.model, name, records)
    odds = rival_odds(found, name)
    total = 1.0 + sum(odds.values())
    believed = belief(found, name, values, precision, records)
    others = {n: believed * w / total for n, w in odds.items()}
    if beside_a_curve(found, name):
        alike = alike_curves(found, name)
        for n in alike:
            others[n] += max(believed - BESIDE_A_CURVE, 0.0) / len(alike)
        believed = min(believed, BESIDE_A_CURVE)
    ranked = sorted(others.items(), key=lambda item: -item[1])[: TEXT.most_listed]
    return Evidence(
        name=name,
        strengths=tuple(float(v) for v in values),
        spread=spread_of(values, precision),
        left=max(found.excess, 0.0) / max(found.base_excess, 1e-300),
        confidence=believed / total,
        alternatives=tuple((n, b) for n, b in ranked if b > TEXT.listed),
        own_share=float(np.sqrt(np.sum(precision) / max(contribution(found.fit.model, name, records), 1e-300))),
    )
