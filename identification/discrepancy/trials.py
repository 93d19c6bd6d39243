"""Trials of a name: the element inserted, everything fitted again, and the best name among those that were tried."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from identification.discrepancy.candidates import admissible, guesses
from identification.discrepancy.excess import contribution, excess_of
from identification.discrepancy.signatures import screen, tangent
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import refined
from identification.physical.model import Element, Model
from identification.record import Record
from identification.scales import scales_of

HELPS = 0.08  # of the excess: less is no help even from one name of several
FULFILS = 0.5  # of its promise: a sprint that closes less has stuck
FIT_ITERATIONS = 14
FLAT = 3e-4  # of the misfit: an iteration that gains less decides nothing
CURVES = ("arctan_damping", "piecewise_linear_damping", "valve_damping", "tanh_hysteresis", "bouc_wen")
_SHORTLIST = 6
_SPRINT = 5  # iterations after which a candidate far behind the best is given up
_FAR = 5.0  # times the least excess
_CLOSE = 1.5  # times the least: of several sprints with one element, those that are worth running on
_PROMISES = 0.5  # of what the best has closed: a stuck sprint whose signature promises less is given up
_DEAD = 0.98  # of the excess: a fit that leaves more has lost its element
_RIVALS = 0.6  # of the promise of the name that is in place: less can't replace it
_AT_NOISE = 0.02  # excess over noise energy at which no other start need be tried
_ALIKE = 0.05  # share of what an element closes by which its form may miss: two that differ by less are alike
_ALIKE_WITHIN = 0.075  # the same where the simpler is a case of the richer: Bouc–Wen takes up any friction's form
_MISSES = 0.3  # or this share of what the best of them leaves, where no form fits well
_NO_LOOP = 0.02  # hysteresis with less offset of its branches is a plain curve: beside another, that one's correction
_OPTIONAL = {
    ("series_compliance", "c"),
    ("tanh_hysteresis", "delta"),
    ("arctan_damping", "d"),
    ("piecewise_linear_damping", "c2"),
    ("bouc_wen", "n"),
    ("gas_spring", "n"),
}  # parameters whose bound is a meaning of its own


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A model with one more element, everything fitted again."""

    name: str
    fit: Fit
    excess: float  # whitened residual energy beyond the noise
    contribution: float  # whitened energy of what the element adds
    parameters: int
    screened: float  # the share its signature promised
    closed: float  # whitened energy by which it lowers the excess


def trials(
    start: Fit, given: Model, records: Sequence[Record], *, incumbent: str | None = None, least: float = 0.0
) -> list[Trial]:
    """The shortlist: elements whose signatures explain most of the residual, each inserted and fitted.

    All run a few iterations; those that are then far behind run no further. With an `incumbent`, only what promises
    nearly as much as that name does is tried: nothing, when it leads alone. What promises less than the share `least`
    of the residual is left out.
    """
    top = [(n, s) for n, s in _shortlist(start, records) if s[0][0] >= least]
    if incumbent is not None:
        bar = _RIVALS * max((s[0][0] for n, s in top if n == incumbent), default=0.0)
        top = [(n, s) for n, s in top if s[0][0] >= bar]
        if [n for n, _ in top] == [incumbent]:
            return []
    sprints = {name: _sprint(start.model.with_element(starts[0][1]), records) for name, starts in top}
    best = min((excess_of(f) for f in sprints.values() if f is not None), default=0.0)
    reach, before = _FAR * max(best, _AT_NOISE * start.samples), excess_of(start)

    def open_(sprint: Fit, promised: float) -> bool:
        """Whether more iterations may pay: near the best, or stuck far short of what the signature promised."""
        closed, stuck = before - excess_of(sprint), promised >= _PROMISES * (1.0 - best / before)
        return (excess_of(sprint) <= reach and closed > HELPS * before) or (
            stuck and closed < FULFILS * promised * before
        )

    fitted = [
        _fitted(start, given, name, starts, records, sprint, full=open_(sprint, starts[0][0]))
        for name, starts in top
        if (sprint := sprints[name]) is not None
    ]
    return [t for t in fitted if t is not None]


def _shortlist(start: Fit, records: Sequence[Record]) -> list[tuple[str, list[tuple[float, Element]]]]:
    model, scales = start.model, scales_of(records, _gap(start, records))
    at = tangent(model, records)
    found = screen(model, [g for n in admissible(model, records, scales) for g in guesses(n, scales)], records, at)
    best: dict[str, list[tuple[float, Element]]] = {}
    for s in found:
        if s.share > 0.0:
            best.setdefault(s.trial.name, []).append((s.share, s.trial))
    return sorted(best.items(), key=lambda item: -item[1][0][0])[:_SHORTLIST]


def _sprint(start: Model, records: Sequence[Record]) -> Fit | None:
    with suppress(SimulationError):
        return fit_records(start, records, max_iterations=_SPRINT)
    return None


def _gap(fit: Fit, records: Sequence[Record]) -> float:
    noise = np.sqrt(np.mean([r.sigma**2 for r in records]))
    return float(np.sqrt(max(fit.rms**2 - noise**2, (0.1 * noise) ** 2)))


def _fitted(
    start: Fit,
    given: Model,
    name: str,
    starts: Sequence[tuple[float, Element]],
    records: Sequence[Record],
    sprint: Fit,
    *,
    full: bool,
) -> Trial | None:
    """Where it is worth a `full` one, go on from the sprint and from what other starts sprint to."""
    model, before, fits = start.model, excess_of(start), [sprint]
    if full:
        rivals = [_sprint(other, records) for other in _starts(model, given, starts)]
        if _dead(min([sprint, *filter(None, rivals)], key=_merit), before):
            # On a bound each time: the last resort is every guess on the base as given.
            rivals += [_sprint(given.with_element(guess), records) for _, guess in starts[1:]]
        fits = _run_on([sprint, *filter(None, rivals)], records)
        raw = min(fits, key=_merit)
        fits.append(refined(raw, last_of(raw.model, name), records))
    best = min(fits, key=_merit)
    own = best.model.elements[last_of(best.model, name)]
    return Trial(
        name=name,
        fit=best,
        excess=excess_of(best),
        contribution=contribution(best.model, name, records),
        parameters=sum(
            not p.fixed and not q.refinement for p, q in zip(own.parameters, own.spec.parameters, strict=True)
        ),
        screened=starts[0][0],
        closed=max(before - excess_of(best), 0.0),
    )


def _dead(fit: Fit, before: float) -> bool:
    return excess_of(fit) > _DEAD * before


def _run_on(sprints: Sequence[Fit], records: Sequence[Record]) -> list[Fit]:
    """The sprints, and what the best of them come to, one after the other until one meets the noise."""
    ranked = sorted(sprints, key=_merit)
    fits, reach = list(ranked), _CLOSE * max(excess_of(ranked[0]), _AT_NOISE * ranked[0].samples)
    for sprint in ranked:
        if excess_of(min(fits, key=_merit)) < _AT_NOISE * sprint.samples or excess_of(sprint) > reach:
            break
        with suppress(SimulationError):
            fits.append(fit_records(sprint.model, records, max_iterations=FIT_ITERATIONS, tolerance=FLAT))
    return fits


def _merit(fit: Fit) -> tuple[bool, float]:
    """What makes one fit better than another: first that its last element is what its name says, then the misfit."""
    return any(_denies(e, fit.model) for e in fit.model.elements), fit.chi2


def _starts(model: Model, given: Model, starts: Sequence[tuple[float, Element]]) -> list[Model]:
    """Where else to fit from: the refitted base has bent to hide the gap, the base as given has not."""
    first, others = starts[0], [s for s in starts[1:] if s[0] > 0.5 * starts[0][0]]
    second = others[0] if others else first
    return [
        given.with_element(first[1]),
        *([model.with_element(second[1])] if others else []),
    ]


def last_of(model: Model, name: str) -> int:
    """Index of the last element of that name."""
    return max(i for i, e in enumerate(model.elements) if e.name == name)


def choose(found: Sequence[Trial]) -> Trial | None:
    """The simplest of those that explain the data as well as a canonical form can be expected to, if any."""
    physical = [t for t in found if not on_bound(t) and not contradicts_itself(t)]
    if not physical:
        return None
    best = min(physical, key=lambda t: t.excess)
    equal = [t for t in physical if t.excess <= best.excess + tolerance(best) + 10.0]
    return min(equal, key=lambda t: (complexity(t), t.excess))


def tolerance(trial: Trial) -> float:
    """Whitened energy by which a simpler form may fit worse and still be the better name.

    A share of what the element closes, not of its whole force: most of that may only trade places with the base.
    """
    alike = _ALIKE_WITHIN if trial.name == "bouc_wen" else _ALIKE
    form = alike**2 * min(trial.contribution, trial.closed)
    return max(form, _MISSES * max(trial.excess, 0.0))


def complexity(trial: Trial) -> float:
    """Free parameters, and one more for a whole damping curve beside the one that the base has."""
    return trial.parameters + (1.0 if trial.name in CURVES else 0.0)


def contradicts_itself(trial: Trial) -> bool:
    """Whether the fit made of the element what its name denies: a Stribeck curve that rises, a loop that is none."""
    return _denies(trial.fit.model.elements[last_of(trial.fit.model, trial.name)], trial.fit.model)


def _denies(own: Element, model: Model) -> bool:
    if own.name == "stribeck_friction":
        return own.value("f_s") <= 1.05 * own.value("f_c")
    beside = any(e.name in CURVES and e is not own for e in model.elements)
    return beside and own.name == "tanh_hysteresis" and own.value("delta") < _NO_LOOP


def on_bound(trial: Trial) -> bool:
    """Whether the fit left the new element without effect: its strength or its only parameter on a bound."""
    own = trial.fit.model.elements[last_of(trial.fit.model, trial.name)]
    vital = [
        (p.value, spec.low if p.low is None else p.low, spec.high if p.high is None else p.high)
        for p, spec in zip(own.parameters, own.spec.parameters, strict=True)
        if not p.fixed and not spec.refinement and (own.name, spec.name) not in _OPTIONAL
    ]
    return any(value <= low or value >= high for value, low, high in vital) or trial.contribution <= 0.0
