"""What speaks for a name: the same strength in every run, a gap that closes, a margin to every rival."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.discrepancy.belief import BESIDE_A_CURVE, belief
from identification.discrepancy.confidence import Features
from identification.discrepancy.excess import contribution, excess_of
from identification.discrepancy.naming import Search
from identification.discrepancy.rewriting import rewritten
from identification.discrepancy.rivals import Rival, alike_curves, beside_a_curve, margin_of, rivals_of
from identification.discrepancy.strength import seen_by, spread_of, strengths, without_the_oddest
from identification.physical.elements import Curve
from identification.record import Record

_LISTED = 0.005  # an alternative less likely than this is none
_MOST_LISTED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Numbers behind one name, on the training records."""

    name: str  # id of the element
    strengths: tuple[float, ...]  # estimated run by run, 1 is the common fit; nan where a run does not excite it
    precision: tuple[float, ...]  # of each, 1/variance
    features: Features
    rivals: tuple[Rival, ...]
    confidence: float
    alternatives: tuple[tuple[str, float], ...]

    @property
    def spread(self) -> float:
        """Scatter of the strengths beyond noise."""
        return self.features.spread


def gather(found: Search, records: Sequence[Record]) -> list[Evidence]:
    """Evidence for every name of a search, in the order in which they were found."""
    moved = rewritten(found, records)
    return [_evidence(found, name, records, moved) for name in found.names]


def _evidence(found: Search, name: str, records: Sequence[Record], moved: float) -> Evidence:
    values, precision = strengths(found.fit.model, name, records)
    own_share = float(np.sqrt(np.sum(precision) / max(contribution(found.fit.model, name, records), 1e-300)))
    rivals = rivals_of(found, name)
    left = max(found.excess, 0.0)
    features = Features(
        spread=spread_of(values, precision),
        spread_but_one=spread_of(*without_the_oddest(values, precision)),
        runs=seen_by(precision),
        left=left / max(found.base_excess, 1e-300),
        left_beside=left / max(excess_of(found.compared[name].without), 1e-300),
        margin=margin_of(rivals),
        own_share=own_share,
        beside_curve=beside_a_curve(found, name),
        whole_curve=found.fit.model.element(name).spec.curve == Curve.WHOLE,
        rewritten=moved,
    )
    confidence, alternatives = _confidence(found, name, features, rivals)
    return Evidence(
        name=name,
        strengths=tuple(float(v) for v in values),
        precision=tuple(float(p) for p in precision),
        features=features,
        rivals=tuple(rivals),
        confidence=confidence,
        alternatives=alternatives,
    )


def _confidence(
    found: Search, name: str, features: Features, rivals: Sequence[Rival]
) -> tuple[float, tuple[tuple[str, float], ...]]:
    """Confidence in a name, and in the likeliest of its rivals."""
    odds = {r.name: r.odds for r in rivals}
    total = 1.0 + sum(odds.values())
    believed = belief(features)
    others = {n: believed * w / total for n, w in odds.items()}
    if features.beside_curve:
        alike = alike_curves(found, name)
        for n in alike:
            others[n] += max(believed - BESIDE_A_CURVE, 0.0) / len(alike)
        believed = min(believed, BESIDE_A_CURVE)
    ranked = sorted(others.items(), key=lambda item: -item[1])[:_MOST_LISTED]
    return believed / total, tuple((n, b) for n, b in ranked if b > _LISTED)
