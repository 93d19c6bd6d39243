"""What speaks for a name: the same strength in every run, a gap that closes, a margin to every rival."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy.excess import contribution, excess_of
from identification.discrepancy.naming import Search
from identification.discrepancy.signatures import orthonormal
from identification.discrepancy.trials import CURVES, allowance, complexity
from identification.errors import SimulationError
from identification.fitting.leastsquares import evaluate, free_parameters, predict
from identification.physical.model import Model
from identification.record import Record

Floats = NDArray[np.float64]

_SPREAD_LIMIT = 0.12  # a true effect has one strength: what differs more than this from run to run is another effect
_SPREAD_SCALE = 0.02
_BUT_ONE = 0.85  # belief in an effect that has one strength in all runs but one
_ENOUGH = 5  # runs that see an effect, of which one may be odd
_DECIDES = 0.3  # share of what all know of a strength: who knows more than this is not the odd one
_SEES = 1e-3  # of what the best record knows of a strength: less is no second opinion
ONE_RUN = 0.7  # belief in a name that no second run can bear out
TWO_RUNS = 0.88  # or that only one other does
BESIDE_A_CURVE = 0.88  # in a curve over velocity beside the base's own: that one may be of another family instead
_ODD_CURVES = ("arctan_damping", "piecewise_linear_damping", "quadratic_damping", "relief_valve", "tanh_hysteresis")
_BASE_CURVES = (*CURVES, "viscous_damping", "quadratic_damping")
_LEFT_LIMIT = 0.40  # what leaves this share of the gap has not explained it
_LEFT_SCALE = 0.06
_PART = 0.25  # of the belief goes where this share is left: something else is there too, or instead
_PART_LEFT = 0.08
_PART_SCALE = 0.015
_POOR = 0.3  # of the belief goes where so much is left of what was missing without the name: a better one may be
_POOR_LEFT = 0.25
_POOR_SCALE = 0.04
_REWRITTEN = 0.5  # share of its given force by which a base may change beside a curve: a third, and a half for luck
_REWRITTEN_SCALE = 0.05
_EVEN = 0.5  # odds of a form that fits as well and is no finer
_PER_PARAMETER = 0.1  # prior odds of a form with one more parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Numbers behind one name, on the training records."""

    name: str
    strengths: tuple[float, ...]  # estimated run by run, 1 is the common fit; nan where a run does not excite it
    spread: float  # their scatter beyond noise
    left: float  # share of the base's gap energy that all names together leave
    confidence: float
    alternatives: tuple[tuple[str, float], ...]
    own_share: float  # of its signature: what no refit of the base could imitate


def strengths(model: Model, name: str, records: Sequence[Record]) -> tuple[Floats, Floats]:
    """Strength of one element in every record, relative to the common fit, and its precision (1/variance), (R,).

    λ_r = 1 + s⊥·r / s⊥·s⊥ over the samples of record r, with s⊥ the element's contribution less all that the other
    parameters could absorb. Where the model can't run without the element, nothing is known of it.
    """
    without = model.without(name)
    free = free_parameters(without, records)
    try:
        base = evaluate(without, records, free)
    except SimulationError:
        return np.full(len(records), np.nan), np.zeros(len(records))
    columns, contributions, residuals = [], [], []
    for r, gradient in zip(records, base.gradients, strict=True):
        force, _ = predict(model, r)
        columns.append(gradient / r.sigma)
        contributions.append((force - predict(without, r)[0]) / r.sigma)
        residuals.append((r.measured - force) / r.sigma)
    basis = orthonormal(np.concatenate(columns))
    stacked = np.concatenate(contributions)
    own = stacked - basis @ (basis.T @ stacked)
    edges = np.cumsum([0] + [r.size for r in residuals])
    values, precision = [], []
    for k, residual in enumerate(residuals):
        s = own[edges[k] : edges[k + 1]]
        energy = float(s @ s)
        values.append(1.0 + float(s @ residual) / energy if energy > 0.0 else np.nan)
        precision.append(energy)
    return np.array(values), np.array(precision)


def spread_of(values: Floats, precision: Floats) -> float:
    """Scatter of strengths beyond their noise, weighted by what each record knows of it."""
    known = precision > _SEES * np.max(precision, initial=0.0)
    if np.sum(known) < 2:
        return 0.0
    v, w = values[known], precision[known]
    mean = float(np.sum(w * v) / np.sum(w))
    variance = float(np.sum(w * (v - mean) ** 2) / np.sum(w)) - (v.size - 1) / float(np.sum(w))
    return float(np.sqrt(max(variance, 0.0)))


def gather(found: Search, records: Sequence[Record]) -> list[Evidence]:
    """Evidence for every name of a search, in the order in which they were found."""
    left = max(found.excess, 0.0) / max(found.base_excess, 1e-300)
    out = []
    for name in found.names:
        values, precision = strengths(found.fit.model, name, records)
        spread = spread_of(values, precision)
        weights = _rival_weights(found, name)
        total = 1.0 + sum(weights.values())
        belief = max(_steady(spread), _BUT_ONE * _steady(spread_of(*_without_the_oddest(values, precision))))
        belief *= 1.0 - 0.9 * _logistic((left - _LEFT_LIMIT) / _LEFT_SCALE)
        belief *= 1.0 - _PART * _logistic((left - _PART_LEFT) / _PART_SCALE)
        alone = max(found.excess, 0.0) / max(excess_of(found.compared[name].without), 1e-300)
        belief *= 1.0 - _POOR * _logistic((alone - _POOR_LEFT) / _POOR_SCALE)
        if name in CURVES:
            belief *= 1.0 - _logistic((_rewritten(found, records) - _REWRITTEN) / _REWRITTEN_SCALE)
        seen_by = int(np.sum(precision > _SEES * np.max(precision, initial=0.0)))
        belief *= {0: ONE_RUN, 1: ONE_RUN, 2: TWO_RUNS}.get(seen_by, 1.0)
        others = {n: belief * w / total for n, w in weights.items()}
        if name in _ODD_CURVES and any(e.name in _BASE_CURVES for e in found.given.on("core")):
            alike = _alike(found, name)
            for n in alike:
                others[n] += max(belief - BESIDE_A_CURVE, 0.0) / len(alike)
            belief = min(belief, BESIDE_A_CURVE)
        ranked = sorted(others.items(), key=lambda item: -item[1])[:3]
        out.append(
            Evidence(
                name=name,
                strengths=tuple(float(v) for v in values),
                spread=spread,
                left=left,
                confidence=belief / total,
                alternatives=tuple((n, b) for n, b in ranked if b > 0.005),
                own_share=float(np.sqrt(np.sum(precision) / max(contribution(found.fit.model, name, records), 1e-300))),
            )
        )
    return out


def _steady(spread: float) -> float:
    """Belief in an effect whose strength scatters so from run to run."""
    return 1.0 - _logistic((spread - _SPREAD_LIMIT) / _SPREAD_SCALE)


def _without_the_oddest(values: Floats, precision: Floats) -> tuple[Floats, Floats]:
    """The strengths but for the one farthest off, where enough are left and it does not decide the common one."""
    known = np.flatnonzero(precision > _SEES * np.max(precision, initial=0.0))
    if known.size < _ENOUGH:
        return values, precision
    away = precision[known] * (values[known] - np.median(values[known])) ** 2
    odd = known[int(np.argmax(away))]
    if precision[odd] > _DECIDES * np.sum(precision[known]):
        return values, precision
    return np.delete(values, odd), np.delete(precision, odd)


def _rewritten(found: Search, records: Sequence[Record]) -> float:
    """How far the force of the base moved from the given one to make room for the names, as a share of it.

    Given values may be off by a third. A curve beside which the base's own becomes another one has replaced it: the
    base may be of the wrong family, and nothing is missing.
    """
    base = found.fit.model
    for name in found.names:
        base = base.without(name)
    moved = total = 0.0
    for r in records:
        with suppress(SimulationError):
            was, now = predict(found.given, r)[0], predict(base, r)[0]
            moved += float(np.sum((now - was) ** 2)) / r.sigma**2
            total += float(np.sum(was**2)) / r.sigma**2
    return float(np.sqrt(moved / total)) if total > 0.0 else 0.0


def _rival_weights(found: Search, name: str) -> dict[str, float]:
    """Odds of each rival against the chosen: worse fits fade by the tolerance of form, finer forms by parsimony.

    As last compared, with most of the other names there; what is named too is no rival. The better a finer form fits,
    within what the chosen one may fit worse, the less its parameters count against it.
    """
    compared = found.compared[name].rivals
    chosen = next(t for t in compared if t.name == name)
    weights = {}
    for t in compared:
        if t.name not in found.names:
            worse = max(t.excess - chosen.excess, 0.0) / allowance(chosen, t)
            better = min(max(chosen.excess - t.excess, 0.0) / allowance(t, chosen), 1.0)
            finer = max(complexity(t) - complexity(chosen), 0.0) * (1.0 - better)
            weights[t.name] = _EVEN * _PER_PARAMETER**finer * float(np.exp(-2.0 * worse))
    return weights


def _alike(found: Search, name: str) -> list[str]:
    """Other curves that fit as well as the one named, and are less simple."""
    compared = found.compared[name].rivals
    chosen = next(t for t in compared if t.name == name)
    curves = [t for t in compared if t.name in _ODD_CURVES and t.name not in found.names]
    return [t.name for t in curves if t.excess <= chosen.excess + allowance(chosen, t)]


def _logistic(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -60.0, 60.0))))


__all__ = ["ONE_RUN", "Evidence", "gather", "spread_of", "strengths"]
