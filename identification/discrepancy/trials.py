"""Trials of a name: the element is inserted and everything fitted again."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.compute import run
from identification.criteria import BUDGET, CHANCE, FORM
from identification.discrepancy.candidates import admissible, guesses, starts_out_of
from identification.discrepancy.choice import Trial, choose, contradicts_itself, is_mistaken, is_unlikely
from identification.discrepancy.excess import contribution_and_form, excess_of, means_left
from identification.discrepancy.signatures import screen, tangent
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.refine import beside_or_within, follows_current, refine_curve, without_needless_shape
from identification.physical.elements import CATALOGUE, Growth
from identification.physical.model import Element, Model, denies_its_name
from identification.record import Record
from identification.scales import scales_of


@dataclass(frozen=True, slots=True)
class _Candidate:
    """First values of one element, by its id, each with the share of the residual that its signature explains, the
    largest first; the short fit from the first of them; and in `beside` a fitted model with a similar element."""

    id: str
    starts: Sequence[tuple[float, Element]]
    beside: Sequence[Model]
    short_fit: Fit

    @property
    def promised(self) -> float:
        return self.starts[0][0]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Round:
    """What all candidates start from, and what the best of them leaves."""

    start: Fit
    given: Model
    records: Sequence[Record]
    few: Sequence[Record]  # the most informative: short fits use only these
    before: float  # excess on the few
    best: float  # the same after the best short fit

    @property
    def reach(self) -> float:
        """The share of the excess that a candidate may leave and still become the best."""
        noise = CHANCE.at_noise * sum(r.measured.size for r in self.few)
        far = max(BUDGET.far_behind * self.best, BUDGET.far_behind * noise, FORM.explained * self.before)
        half_way = self.best + BUDGET.half_as_good * (self.before - self.best)
        return min(far, half_way, (1.0 - FORM.helps) * self.before) / self.before

    def is_near(self, fit: Fit, before: float) -> bool:
        return excess_of(fit) <= self.reach * before

    def needs_more_starts(self, candidate: _Candidate) -> bool:
        """Whether other starts may help: near the best, or far short of what the signature explains."""
        return self.is_stuck(candidate.short_fit, candidate) or self.is_near(candidate.short_fit, self.before)

    def is_stuck(self, short_fit: Fit, candidate: _Candidate) -> bool:
        """Whether a fit is far short of what the signature explains, and that is not little."""
        closed = 1.0 - excess_of(short_fit) / self.before
        promising = candidate.promised >= BUDGET.half_as_good * (1.0 - self.best / self.before)
        return promising and closed < BUDGET.half_as_good * candidate.promised


def trials(
    start: Fit,
    given: Model,
    records: Sequence[Record],
    *,
    incumbent: str | None = None,
    beside: Model | None = None,
    least: float = 0.0,
    excluded: Collection[str] = (),
) -> list[Trial]:
    """The shortlist: elements whose signatures explain most of the residual, each inserted and fitted.

    Each gets a short fit on the most informative records; candidates that are then far behind are not fitted further.
    With an `incumbent`, an id, only elements whose signatures explain nearly as much as its own are tried: none, where
    it is the only one; `beside` is the model as fitted with it, a good start for a similar element. Elements that
    explain less than the share `least` of the residual are left out, and so are the names in `excluded`.
    """
    top = [(i, s) for i, s in _shortlist(start, records, excluded) if s[0][0] >= least]
    if incumbent is not None:
        bar = BUDGET.half_as_good * max((s[0][0] for i, s in top if i == incumbent), default=0.0)
        top = [(i, s) for i, s in top if s[0][0] >= bar]
        if [i for i, _ in top] == [incumbent]:
            return []
    few = _most_informative(start, records)
    short_fits = _short_fits([start.model.with_element(starts[0][1]) for _, starts in top], few)
    candidates = [
        _Candidate(own_id, starts, _fitted_starts(incumbent, beside, starts[0][1]), short_fit)
        for (own_id, starts), short_fit in zip(top, short_fits, strict=True)
        if short_fit is not None
    ]
    leader = min((c.short_fit for c in candidates), key=_merit, default=start)
    before, best = _excess_on(start, records, few), excess_of(leader)
    round_ = _Round(start=start, given=given, records=records, few=few, before=before, best=best)
    found = [t for t in run(partial(_fit_candidate, its=round_), candidates) if t is not None]
    found = [_fit_from_simpler(t, found, round_) if contradicts_itself(t) else t for t in found]
    return _with_limits(found, round_, excluded)


def _fitted_starts(incumbent: str | None, beside: Model | None, guess: Element) -> list[Model]:
    """The model as fitted with the incumbent, which the guess of another element replaces."""
    if beside is None or incumbent is None:
        return []
    return [beside if guess.id == incumbent else beside.without(incumbent).with_element(guess)]


def _fit_from_simpler(denied: Trial, found: Sequence[Trial], its: _Round) -> Trial:
    """Repeat a trial that contradicts its name from the simpler element that fits, where there is one."""
    growth = denied.own.spec.growth
    simpler = [t for t in found if growth is not None and t.name == growth.of]
    again = _fit_out_of(simpler[0], growth, denied.name, its) if growth is not None and simpler else None
    return denied if again is None or contradicts_itself(again) else again


def _with_limits(found: list[Trial], its: _Round, excluded: Collection[str]) -> list[Trial]:
    """The trials and, as long as the choice is a richer element, those of its limits that start out of its fit and are
    no worse than it: then the richer one says nothing more. Of one that is mistaken or unlikely, all limits.

    A signature promises little where no first value is near: a limit of the element that fits has its values.
    """
    tried, out = set[str](), {*excluded, *(e.name for e in its.start.model.elements)}
    while richer := [t for t in found if t.name not in tried and (t is choose(found) or is_mistaken(t))]:
        rich = richer[0]
        tried.add(rich.name)
        worst = np.inf if is_mistaken(rich) or is_unlikely(rich) else rich.excess + CHANCE.slack
        for name, growth in _limits_of(rich.name):
            limit = None if name in out else _fit_out_of(rich, growth, name, its)
            if limit is not None and limit.excess <= worst:
                found = [*(t for t in found if t.name != name or t.excess < limit.excess), limit]
    return found


def _limits_of(name: str) -> list[tuple[str, Growth]]:
    """The elements that the search may name and that are limits of the one of that name, and how."""
    rows = [(other, spec) for other, spec in CATALOGUE.items() if spec.nameable]
    return [(other, growth) for other, spec in rows for growth in spec.limits_of if growth.of == name]


def _fit_out_of(fitted: Trial, growth: Growth, name: str, its: _Round) -> Trial | None:
    """The trial of an element of that name that starts out of another one that fits; None where it can't run."""
    scales = scales_of(its.records, _rms_gap(its.start, its.records))
    new = [its.start.model.numbered(e) for e in starts_out_of(fitted.own, name, growth, scales)]
    starts = [fitted.fit.model.replacing(fitted.id, e) for e in new]
    short_fits = _completed_short_fits(starts, its.few)
    fits = _continue_fits(short_fits, its.records, BUDGET.fit_iterations) if short_fits else []
    if not fits:
        return None
    return trial_of(min(fits, key=_merit), new[0].id, its.start, its.records, fitted.screened)


def _shortlist(
    start: Fit, records: Sequence[Record], excluded: Collection[str]
) -> list[tuple[str, list[tuple[float, Element]]]]:
    model, scales = start.model, scales_of(records, _rms_gap(start, records))
    # What has not settled after this time is in both simulations.
    quick = [replace(r, motion=replace(r.motion, ahead=BUDGET.settling_s)) for r in records]
    at = tangent(model, quick)
    names = [n for n in admissible(model, records, scales) if n not in excluded]
    mounted = bool(model.on("mount"))
    every = [model.numbered(g) for n in names for g in guesses(n, scales, mounted=mounted)]
    first = [g for g in every if not denies_its_name(g, model)]  # what is only beside another is tried there
    found = screen(model, first, quick, at)
    best: dict[str, list[tuple[float, Element]]] = {}
    for s in found:
        if s.share > 0.0:
            best.setdefault(s.trial.id, []).append((s.share, s.trial))
    return sorted(best.items(), key=lambda item: -item[1][0][0])[: BUDGET.shortlist]


def _most_informative(fit: Fit, records: Sequence[Record]) -> list[Record]:
    """The fewest records that hold most of the gap: enough to rank the candidates."""
    energy = np.array([_excess_on(fit, records, [r]) for r in records])
    order = np.argsort(-energy)
    share = np.cumsum(energy[order]) / max(float(np.sum(energy)), 1e-300)
    count = max(BUDGET.short_fit_records, int(np.searchsorted(share, BUDGET.short_fit_share)) + 1)
    kept = set(order[:count].tolist())
    return [r for k, r in enumerate(records) if k in kept]


def _excess_on(fit: Fit, records: Sequence[Record], some: Sequence[Record]) -> float:
    """Whitened residual energy of a fit to all records beyond the noise, on some of them."""
    pairs = [(e, r) for e, r in zip(fit.residuals, records, strict=True) if any(r is s for s in some)]
    return sum(float(np.dot(e, e)) / r.sigma**2 - e.size for e, r in pairs)


def _short_fits(starts: Sequence[Model], few: Sequence[Record]) -> list[Fit | None]:
    """The fit of each start after a few iterations; None for one that can't run."""
    return run(partial(_short_fit, few=few), starts)


def _completed_short_fits(starts: Sequence[Model], few: Sequence[Record]) -> list[Fit]:
    """The same for those that can run."""
    return [s for s in _short_fits(starts, few) if s is not None]


def _short_fit(start: Model, few: Sequence[Record]) -> Fit | None:
    with suppress(SimulationError):
        return fit_records(start, few, max_iterations=BUDGET.short_fit_iterations)
    return None


def _rms_gap(fit: Fit, records: Sequence[Record]) -> float:
    noise = np.sqrt(np.mean([r.sigma**2 for r in records]))
    return float(np.sqrt(max(fit.rms**2 - noise**2, CHANCE.at_noise * noise**2)))


def _fit_candidate(candidate: _Candidate, its: _Round) -> Trial | None:
    """Continue the short fit of a candidate and, where it needs them, those of other starts.

    A candidate that stays far behind gets a few iterations on all records: its effect may be in those that the short
    fits do not use.
    """
    full, short_fits = its.needs_more_starts(candidate), [candidate.short_fit]
    if full:
        tried = [*_other_starts(its.start.model, its.given, candidate.starts), *candidate.beside]
        short_fits += _completed_short_fits(tried, its.few)
        if its.is_stuck(min(short_fits, key=_merit), candidate):
            every = [its.start.model.with_element(guess) for _, guess in candidate.starts[1:]]
            short_fits += _completed_short_fits([m for m in every if m not in tried], its.few)
        if _has_no_effect(min(short_fits, key=_merit), its.before):
            # All ended on a bound: as the last resort, every guess on the base as given.
            short_fits += _completed_short_fits(
                [its.given.with_element(guess) for _, guess in candidate.starts[1:]], its.few
            )
    near = full and its.is_near(min(short_fits, key=_merit), its.before)
    fits = _continue_fits(short_fits, its.records, BUDGET.fit_iterations if near else BUDGET.last_look_iterations)
    if not fits:
        return None
    if full and not near and its.is_near(min(fits, key=_merit), excess_of(its.start)):
        fits = _continue_fits(fits, its.records, BUDGET.fit_iterations) or fits
    if full:
        raw = min(fits, key=_merit)
        if raw.model.element(candidate.id).spec.path == "mount":
            for index in range(len(raw.model.elements)):  # what the others are behind is new
                raw = beside_or_within(raw, index, its.records)
        at = raw.model.ids.index(candidate.id)
        plain = without_needless_shape(raw, at, its.records)
        fits = [refine_curve(plain, at, its.records, gains=follows_current(its.given))]
    with suppress(SimulationError):
        return trial_of(min(fits, key=_merit), candidate.id, its.start, its.records, candidate.promised)
    return None


def trial_of(fit: Fit, own_id: str, start: Fit, records: Sequence[Record], screened: float) -> Trial:
    """A fit as a trial of the element of that id in it, added to what `start` is a fit of."""
    own = fit.model.element(own_id)
    pairs = zip(own.parameters, own.spec.parameters, strict=True)
    # Those of a finer shape count: a stop that hardens would be preferred to a gas spring of as many parameters.
    free = [not p.fixed and (bool(q.shape) or not q.refinement) for p, q in pairs]
    whole, formed = contribution_and_form(fit.model, own_id, records)
    scales = scales_of(records, 0.0)
    return Trial(
        id=own_id,
        fit=fit,
        excess=excess_of(fit),
        contribution=whole,
        formed=formed,
        parameters=sum(free),
        means_left=means_left(fit, records),
        screened=screened,
        closed=max(excess_of(start) - excess_of(fit), 0.0),
        measured=sum(float(np.dot(r.measured, r.measured)) / r.sigma**2 for r in records),
        force=float(np.sqrt(np.mean(np.concatenate([r.measured for r in records]) ** 2))),
        stroke=max(float(np.ptp(r.motion.x)) for r in records),
        swing=max(float(np.ptp(r.motion.i)) for r in records),
        speed=scales.v_rms,
        slow=scales.speeds[0],
        current=float(np.mean(np.concatenate([r.motion.i[r.window] for r in records]))),
    )


def _has_no_effect(fit: Fit, before: float) -> bool:
    return excess_of(fit) > (1.0 - FORM.helps) * before


def _continue_fits(short_fits: Sequence[Fit], records: Sequence[Record], iterations: int) -> list[Fit]:
    """Continue the best of the short fits on all records, one after the other until one meets the noise."""
    ranked = distinct(sorted(short_fits, key=_merit))
    fits: list[Fit] = []
    reach = max(excess_of(ranked[0]), CHANCE.at_noise * ranked[0].samples) / BUDGET.half_as_good
    for fit in ranked:
        enough = len(fits) == BUDGET.continued_fits or excess_of(fit) > reach
        if fits and (enough or _at_noise(min(fits, key=_merit))):
            break
        with suppress(SimulationError):
            fits.append(fit_records(fit.model, records, max_iterations=iterations, tolerance=BUDGET.flat))
    return fits


def distinct(ranked: Sequence[Fit]) -> list[Fit]:
    """Those that simulate something else than all better ones."""
    kept: list[Fit] = []
    for fit in ranked:
        if not any(_simulate_the_same(fit, better) for better in kept):
            kept.append(fit)
    return kept


def _simulate_the_same(fit: Fit, other: Fit) -> bool:
    """Whether the forces of two fits to the same records differ by little of their residual."""
    pairs = list(zip(fit.residuals, other.residuals, strict=True))
    differ = sum(float(np.sum((a - b) ** 2)) for a, b in pairs)
    return differ < BUDGET.same_force * sum(float(np.dot(b, b)) for _, b in pairs)


def _at_noise(fit: Fit) -> bool:
    return excess_of(fit) < CHANCE.at_noise * fit.samples


def _merit(fit: Fit) -> tuple[bool, float]:
    """Sort key of fits: first whether an element contradicts its name, then the misfit."""
    return any(denies_its_name(e, fit.model) for e in fit.model.elements), fit.chi2


def _other_starts(model: Model, given: Model, starts: Sequence[tuple[float, Element]]) -> list[Model]:
    """Further starts: the refitted base has absorbed part of the gap, the base as given has not."""
    first, others = starts[0], [s for s in starts[1:] if s[0] > BUDGET.half_as_good * starts[0][0]]
    second = others[0] if others else first
    return [
        given.with_element(first[1]),
        *([model.with_element(second[1])] if others else []),
    ]
