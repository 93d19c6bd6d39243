"""How far a name is believed: what speaks against it by itself, and the odds of each of its rivals."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search
from identification.discrepancy.strength import seen_by, spread_of, without_the_oddest
from identification.discrepancy.trials import allowance, complexity
from identification.errors import SimulationError
from identification.physical.elements import Curve
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import Record

Floats = NDArray[np.float64]

ONE_RUN = 0.7  # belief in a name that no second run can bear out
TWO_RUNS = 0.88  # or that only one other does
BESIDE_A_CURVE = 0.88  # in a curve over velocity beside the base's own: that one may be of another family instead
_SPREAD_LIMIT = 0.12  # a true effect has one strength: what differs more than this from run to run is another effect
_SPREAD_SCALE = 0.02
_BUT_ONE = 0.85  # belief in an effect that has one strength in all runs but one
_LEFT = (0.9, 0.40, 0.06)  # of the belief goes where this share of the gap is left, ± so much: it is not explained
_PART = (0.25, 0.08, 0.015)  # something else is there too, or instead
_POOR = (0.3, 0.25, 0.04)  # the same for the share of what was missing without the name: a better one may be there
_REWRITTEN = (1.0, 0.5, 0.05)  # or of its given force by which a base changed beside a curve: a third, half for luck
_EVEN = 0.5  # odds of a form that fits as well and is no finer
_PER_PARAMETER = 0.1  # prior odds of a form with one more parameter


def belief(found: Search, name: str, values: Floats, precision: Floats, records: Sequence[Record]) -> float:
    """Belief in a name before its rivals, 0 … 1, from its strength in every record and its precision, (R,) each."""
    left = max(found.excess, 0.0)
    out = max(_steady(spread_of(values, precision)),
              _BUT_ONE * _steady(spread_of(*without_the_oddest(values, precision))))  # fmt: skip
    out *= _less(left / max(found.base_excess, 1e-300), *_LEFT)
    out *= _less(left / max(found.base_excess, 1e-300), *_PART)
    out *= _less(left / max(excess_of(found.compared[name].without), 1e-300), *_POOR)
    if found.fit.model.element(name).spec.curve == Curve.WHOLE:
        out *= _less(_rewritten(found, records), *_REWRITTEN)
    return out * {0: ONE_RUN, 1: ONE_RUN, 2: TWO_RUNS}.get(seen_by(precision), 1.0)


def beside_a_curve(found: Search, name: str) -> bool:
    """Whether a name is a curve over velocity and the base has one of its own."""
    return found.fit.model.element(name).spec.bent and any(e.spec.carries for e in found.given.on("core"))


def rival_odds(found: Search, name: str) -> dict[str, float]:
    """Odds of each rival against the chosen: worse fits fade by the tolerance of form, finer forms by parsimony.

    As last compared, with most of the other names there; what is named too is no rival. The better a finer form fits,
    within what the chosen one may fit worse, the less its parameters count against it.
    """
    compared = found.compared[name].rivals
    chosen = next(t for t in compared if t.id == name)
    weights = {}
    for t in compared:
        if t.id not in found.names:
            worse = max(t.excess - chosen.excess, 0.0) / allowance(chosen, t)
            better = min(max(chosen.excess - t.excess, 0.0) / allowance(t, chosen), 1.0)
            finer = max(complexity(t) - complexity(chosen), 0.0) * (1.0 - better)
            weights[t.name] = _EVEN * _PER_PARAMETER**finer * float(np.exp(-2.0 * worse))
    return weights


def alike_curves(found: Search, name: str) -> list[str]:
    """Other curves that fit as well as the one named, and are less simple."""
    compared = found.compared[name].rivals
    chosen = next(t for t in compared if t.id == name)
    curves = [t for t in compared if t.own.spec.bent and t.id not in found.names]
    return [t.name for t in curves if t.excess <= chosen.excess + allowance(chosen, t)]


def _rewritten(found: Search, records: Sequence[Record]) -> float:
    """How far the base's own curves moved from the given ones to make room for the names, as a share of its force,
    of the given or the fitted, whichever is larger.

    Given values may be off by a third. A curve beside which the base's own becomes another one has replaced it: the
    base may be of the wrong family, and nothing is missing.
    """
    base = found.fit.model
    for name in found.names:
        base = base.without(name)
    given, now = _curves_of(found.given), _curves_of(base)
    if given is None or now is None:
        return 0.0
    moved = was = became = 0.0
    for r in records:
        with suppress(SimulationError):
            change, old, new = (
                predict(now, r)[0] - predict(given, r)[0],
                predict(found.given, r)[0],
                predict(base, r)[0],
            )
            moved += float(np.sum(change**2)) / r.sigma**2
            was += float(np.sum(old**2)) / r.sigma**2
            became += float(np.sum(new**2)) / r.sigma**2
    return float(np.sqrt(moved / max(was, became))) if was > 0.0 else 0.0


def _curves_of(model: Model) -> Model | None:
    """The model less the springs and masses beside its curves over velocity; None without such curves."""
    curves = [e for e in model.on("core") if e.spec.carries]
    beside = [e for e in model.elements if e.spec.path in ("mount", "control") or e.spec.modifier]
    return replace(model, elements=(*beside, *curves)) if curves else None


def _steady(spread: float) -> float:
    """Belief in an effect whose strength scatters so from run to run."""
    return _less(spread, 1.0, _SPREAD_LIMIT, _SPREAD_SCALE)


def _less(value: float, share: float, limit: float, scale: float) -> float:
    """What is left of a belief of which `share` goes where a value is over its limit, gradually over the scale."""
    return 1.0 - share * float(1.0 / (1.0 + np.exp(-np.clip((value - limit) / scale, -60.0, 60.0))))
