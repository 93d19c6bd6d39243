"""The evidence for a name: the same strength in every run, a gap that closes, a margin to every rival."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from identification.criteria import TEXT
from identification.discrepancy.confidence import Features, confidence, doubts
from identification.discrepancy.confidence_table import fitted_table
from identification.discrepancy.excess import contribution, excess_of, significant_excess
from identification.discrepancy.naming import Search
from identification.discrepancy.rivals import Rival, beside_a_curve, beside_a_loop, margin_of, rivals_of
from identification.discrepancy.strength import seen_by, spread_of, strengths
from identification.errors import SimulationError
from identification.physical.elements import CATALOGUE
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record


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


def gather(found: Search, records: Sequence[Record], held_out: Sequence[Record]) -> list[Evidence]:
    """Evidence for every name of a search, in the order in which they were found.

    It is that of the records that the search was fitted to, but for what a name closes on those held out.
    """
    return [_evidence(found, name, records, held_out) for name in found.names]


def beside_withheld(found: Search, stated: Sequence[Evidence], withheld: Sequence[Evidence]) -> list[Evidence]:
    """The evidence for stated names with the withheld ones among their alternatives; no confidence depends on these."""
    gone = [w.name for w in withheld]
    return [replace(e, alternatives=_alternatives(1.0 - e.confidence, rivals_of(found, e.name, gone))) for e in stated]


def _evidence(found: Search, name: str, records: Sequence[Record], held_out: Sequence[Record]) -> Evidence:
    model, without = found.fit.model, excess_of(found.compared[name].without)
    left = max(found.excess, 0.0) / max(without, 1e-300)
    strength, precision = strengths(model, name, records)
    own_share = float(np.sqrt(np.sum(precision) / max(contribution(model, name, records), 1e-300)))
    rivals = rivals_of(found, name)
    features = Features(
        spread=spread_of(strength, precision),
        runs=seen_by(precision),
        left_beside=left,
        left_held_out=_left_on(held_out, name, model, found.compared[name].without.model, left),
        margin=margin_of(rivals),
        own_share=own_share,
        beside_curve=beside_a_curve(found, name),
        beside_loop=beside_a_loop(found, name),
    )
    believed = confidence(features, fitted_table())
    return Evidence(
        name=name,
        strengths=tuple(float(v) for v in strength),
        precision=tuple(float(p) for p in precision),
        features=features,
        rivals=tuple(rivals),
        confidence=believed,
        alternatives=_alternatives(1.0 - believed, rivals),
    )


def _left_on(records: Sequence[Record], name: str, model: Model, without: Model, unseen: float) -> float:
    """Share of what is missing on records without a name that is left with it; `unseen` where nothing is missing or it
    does not act on them, as a stop that no stroke reaches, or no model can run on them; without end where only the one
    with the name can't."""
    before, after = excess_on(records, without), excess_on(records, model)
    least = significant_excess(records)
    if before <= least or before == after == math.inf:
        return unseen
    if after < math.inf and contribution(model, name, records) <= least:
        return unseen
    return max(after, 0.0) / before


def excess_on(records: Sequence[Record], model: Model) -> float:
    """Whitened residual energy of a model on records that it was not fitted to, beyond the noise; without end where it
    can't run on them."""
    try:
        rests = [(r.measured - predict(model, r)[0]) / r.sigma for r in records]
    except SimulationError:
        return math.inf
    return sum(float(np.dot(e, e)) - e.size for e in rests)


def main_doubt(evidence: Evidence) -> str:
    """What takes most off the confidence of a name, in words with its figure."""
    features, table = evidence.features, fitted_table()
    against = {name: table.weights[name] * d for name, d in doubts(features).items()}
    seen = [v for v, p in zip(evidence.strengths, evidence.precision, strict=True) if p > 0.0]
    words = {
        "scatter": f"its strength is {min(seen, default=0.0):.2f} to {max(seen, default=0.0):.2f} times the common one "
        f"from run to run, a scatter of {features.spread:.0%} beyond noise",
        "few_runs": f"{features.runs} {'run shows' if features.runs == 1 else 'runs show'} it",
        "left_held_out": f"{features.left_held_out:.0%} of the gap without it stays with it on the held-out runs"
        if math.isfinite(features.left_held_out)
        else "the model with it can't run on the held-out runs",
        "rivalry": f"{_closest(evidence.rivals)} is only {max(features.margin, 0.0):.1f} tolerances of form behind",
        "imitated": f"a refit of the base imitates {1.0 - features.own_share**2:.0%} of it",
        "beside_curve": "the damping curve of the base may be wrong instead",
        "beside_loop": "another element acts just after the motion turns, and how it does may be wrong instead",
    }
    return words[max(against, key=lambda name: against[name])]


def _closest(rivals: Sequence[Rival]) -> str:
    best = min(rivals, key=lambda r: r.margin, default=None)
    return "nothing else" if best is None else CATALOGUE[best.name].title


def _alternatives(doubt: float, rivals: Sequence[Rival]) -> tuple[tuple[str, float], ...]:
    """The likeliest rivals and their shares of the doubt: e^-margin of each, against 1 for what was not tried."""
    total = 1.0 + sum(exp(-r.margin) for r in rivals)
    ranked = sorted(((r.name, doubt * exp(-r.margin) / total) for r in rivals), key=lambda item: -item[1])
    return tuple((n, share) for n, share in ranked[: TEXT.most_listed] if share > TEXT.listed)
