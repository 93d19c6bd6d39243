"""Explain a gap: from a base model and measured runs to the names of what the model is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy.candidates import unlimited
from identification.discrepancy.confidence import ONE_RUN, TWO_RUNS
from identification.discrepancy.equation import describe
from identification.discrepancy.evidence import Evidence, gather
from identification.discrepancy.excess import (
    FORM_TOLERANCE,
    excess_of,
    material_excess,
    misshapen,
    significant_excess,
)
from identification.discrepancy.explanation import (
    Effect,
    Explanation,
    Gaps,
    NextTest,
    Traces,
    Verdict,
    gaps_of,
)
from identification.discrepancy.hum import Hum, find_hum, hum_in
from identification.discrepancy.naming import Compared, Search, without_departures
from identification.discrepancy.nexttest import propose
from identification.discrepancy.notes import coarse, finer, of_runs, tared_apart, unnamed
from identification.discrepancy.preparation import prepared
from identification.discrepancy.search import search
from identification.discrepancy.signatures import tangent
from identification.discrepancy.where import Region, locate
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records, predict
from identification.motion_noise import with_motion_noise
from identification.physical.elements import CATALOGUE, TONE
from identification.physical.model import Element, Model, name_of
from identification.record import Record, compact, noise_without, same_load_cell
from rigctl.runfile import Run

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

_UTTER = 0.4  # below this confidence a name is no name: of the few that were ever stated below it none was right
_AMBIGUOUS = 0.9  # below this confidence the next test is worth its rig time
_FEW = 2  # training runs: fewer leave too much unseen to say that nothing is missing
_NEAR_FLOOR = 0.35  # an excess below this share of the noise can't be told from it run by run


def explain(
    model: Model | None,
    runs: Sequence[Run],
    held_out: Sequence[Run] | None = None,
    *,
    on_progress: Progress | None = None,
) -> Explanation:
    """Find where `model` and the runs disagree, name what is missing, add it, and show the gap shrink.

    Parameters
    ----------
    model : the simulation as it is today; its parameters may be off. None: it is the channel `force_simulated` of
        every run, from any program; then effects on the core and sensor paths are named on top of it
    runs : measured on one specimen
    held_out : runs that no fit may see; without them some of `runs` are kept back

    Raises
    ------
    DataError
        when the runs can't be used together, or not for this model.
    SimulationError
        when the model as given can't run on them.
    """
    say = on_progress or (lambda text, done: None)
    say("preparing the runs", 0.0)
    model, train, held = prepared(model, runs, held_out)
    say("fitting the model as given", 0.05)
    base = fit_records(model, [compact(r) for r in train])
    named = _named(model, base, _hum_beside(base.model, train), train, held, say)
    if named.hum is not None and named.found.names and _hum_beside(named.found.fit.model, named.train) is None:
        say("the tone was part of what has been named: looking again without it", 0.5)
        named = _named(model, base, None, train, held, lambda text, done: say(text, max(done, 0.5)))
    say("fitting the named effects", 0.8)
    return _conclude(model, named, say)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Named:
    """What a search found, and the records that it stands on: whole, kept back, and compact without the hum."""

    base: Fit
    found: Search
    evidence: Sequence[Evidence]
    hum: Hum | None
    train: Sequence[Record]
    held: Sequence[Record]
    quiet: Sequence[Record]


def _named(
    model: Model, base: Fit, hum: Hum | None, train: Sequence[Record], held: Sequence[Record], say: Progress
) -> _Named:
    """Search for what `base` is missing beside a hum."""
    quiet = _without_hum(base, hum, train)
    if hum is not None:
        train, held = _noise_beside(base, hum, train, held)
        quiet = _without_hum(base, hum, train)
        base = fit_records(model, quiet)
    train, held = ([with_motion_noise(r, base.model) for r in rs] for rs in (train, held))
    quiet = [_as_noisy(q, r) for q, r in zip(quiet, train, strict=True)]
    base = fit_records(base.model, quiet)
    say("looking for what is missing", 0.2)
    found = search(model, base, quiet, on_progress=lambda text: say(text, 0.4))
    found, evidence = _through_the_gates(found, quiet)
    found = without_departures(found, quiet)
    evidence = [e for e in evidence if e.name in found.names]
    return _Named(base=base, found=found, evidence=evidence, hum=hum, train=train, held=held, quiet=quiet)


def _hum_beside(model: Model, train: Sequence[Record]) -> Hum | None:
    """Mains hum, if all runs share one that the model has not."""
    if model.has(TONE.name):
        return None
    return find_hum([r.measured - predict(model, r)[0] for r in train], train)


def _without_hum(base: Fit, hum: Hum | None, train: Sequence[Record]) -> list[Record]:
    """The compact records with the hum taken out."""
    if hum is None:
        return [compact(r) for r in train]
    return [compact(r, hum_in(r, r.measured - predict(base.model, r)[0], hum)) for r in train]


def _noise_beside(
    base: Fit, hum: Hum, train: Sequence[Record], held: Sequence[Record]
) -> tuple[list[Record], list[Record]]:
    """The records with the noise that they have beside the hum."""
    every = [*train, *held]
    residuals = [r.measured - predict(base.model, r)[0] for r in every]
    quiet = [noise_without(r, hum_in(r, e, hum)) for r, e in zip(every, residuals, strict=True)]
    quiet = same_load_cell(quiet)
    return quiet[: len(train)], quiet[len(train) :]


def _as_noisy(quiet: Record, record: Record) -> Record:
    """The compact record with the noise that has since been found in the whole one."""
    return replace(quiet, sigma=compact(record).sigma, independent=record.independent, modelled=record.modelled)


def _through_the_gates(found: Search, records: Sequence[Record]) -> tuple[Search, list[Evidence]]:
    """Take back, one by one, the names that one strength in all runs does not bear out."""
    while found.names:
        evidence = gather(found, records)
        weakest = min(evidence, key=lambda e: e.confidence)
        if weakest.confidence >= _UTTER:
            return found, evidence
        try:
            rest = fit_records(found.fit.model.without(weakest.name), records)
        except SimulationError:  # it holds the model up
            return found, evidence
        names = tuple(n for n in found.names if n != weakest.name)
        found = replace(found, fit=rest, names=names, excess=excess_of(rest))
    return found, []


@dataclass(frozen=True, slots=True)
class _Final:
    model: Model
    names: tuple[str, ...]


def _conclude(given: Model, named: _Named, say: Progress) -> Explanation:
    base, found, hum, evidence = named.base, named.found, named.hum, named.evidence
    train, held, quiet = named.train, named.held, named.quiet
    shaped = found.fit.model != base.model
    grown = found.fit.model if hum is None else found.fit.model.with_element(hum.element())
    mine = [e.id in found.names or e.id not in base.model.ids for e in grown.elements]
    grown = replace(grown, elements=tuple(unlimited(e) if m else e for e, m in zip(grown.elements, mine, strict=True)))
    final = fit_records(grown, train, max_iterations=12) if (found.names or hum or shaped) else base
    full_base = fit_records(base.model, train, max_iterations=8)
    traces = [_trace(r, given, full_base.model, final.model, held_out=False) for r in train]
    traces += [_trace(r, given, full_base.model, final.model, held_out=True) for r in held]
    forces = [(t.as_given, t.refitted, t.final) for t in traces]
    in_train, in_held = gaps_of(train, forces[: len(train)]), gaps_of(held, forces[len(train) :])
    names = found.names + ((TONE.name,) if hum else ())
    left = _left_over(found, hum, quiet) or not _carries_over(in_held)
    verdict = _verdict(found, names, left, quiet)
    regions, profiles = locate([r.measured - predict(base.model, r)[0] for r in quiet], quiet)
    effects = _effects(final, found, evidence, hum, in_train, train)
    if verdict == Verdict.NO_DISCREPANCY:
        effects, regions = (), []
    say("designing the next test", 0.95)
    doubted = min(evidence, key=lambda e: e.confidence).name if evidence else None
    next_test = propose(found, doubted, quiet) if _in_doubt(verdict, effects, len(train)) else NextTest()
    return Explanation(
        verdict=verdict,
        effects=effects,
        train=in_train,
        held_out=in_held,
        where=tuple(regions),
        profiles=tuple(profiles),
        repeatable=verdict in (Verdict.UNKNOWN_EFFECT, Verdict.PARTLY_EXPLAINED),
        remainder=_remainder(verdict, found, quiet, regions, in_train.noise_floor) + _unseen(verdict, in_held, traces),
        next_test=next_test,
        given=given,
        base=full_base,
        model=replace(final.model, name=_name(given, names)),
        moves=found.moves,
        compared={name_of(n): _by_name(found.compared[n]) for n in found.names},
        traces=tuple(traces),
        notes=(
            *of_runs(train, held),
            *finer(base.model, found.fit.model),
            *unnamed(base.model, final.model, names),
            *tared_apart(traces),
            *coarse(final.model, quiet),
        ),
    )


def _by_name(compared: Compared) -> Compared:
    """The same for a reader, who knows names and no ids."""
    return replace(compared, beside=tuple(name_of(n) for n in compared.beside))


def _in_doubt(verdict: Verdict, effects: Sequence[Effect], runs: int) -> bool:
    """Whether a further test is worth its rig time."""
    if verdict == Verdict.NO_DISCREPANCY:
        return runs < _FEW
    return verdict != Verdict.EXPLAINED or any(e.confidence < _AMBIGUOUS for e in effects)


def _trace(record: Record, given: Model, base: Model, final: Model, *, held_out: bool) -> Traces:
    forces = [predict(m, record)[0] for m in (given, base, final)]
    return Traces(record=record, as_given=forces[0], refitted=forces[1], final=forces[2], held_out=held_out)


def _left_over(found: Search, hum: Hum | None, records: Sequence[Record]) -> bool:
    """Whether something repeatable stays that neither noise nor the form of what was named can answer for."""
    samples = sum(r.measured.size for r in records)
    form = misshapen(found.fit.model, found.names, records, found.base_excess - found.excess)
    if hum is not None:
        form += FORM_TOLERANCE**2 * sum(0.5 * hum.amplitude**2 * r.measured.size / r.sigma**2 for r in records)
    floor = max(material_excess(records), significant_excess(records), _NEAR_FLOOR**2 * samples)
    return found.excess > floor + form


def _carries_over(held: Gaps) -> bool:
    """Whether what was named closes the gap on runs that no fit has seen: to the noise, or but for twice what the form
    of an element may miss where it was fitted."""
    at_noise = held.final**2 < (1.0 + _NEAR_FLOOR**2) * held.noise_floor**2
    return at_noise or held.closed is None or held.closed > 1.0 - 2.0 * FORM_TOLERANCE


def _verdict(found: Search, names: Sequence[str], left: bool, records: Sequence[Record]) -> Verdict:
    if not names:
        gap = found.excess > max(material_excess(records), significant_excess(records))
        return Verdict.UNKNOWN_EFFECT if gap else Verdict.NO_DISCREPANCY
    return Verdict.PARTLY_EXPLAINED if left else Verdict.EXPLAINED


def _effects(
    final: Fit,
    found: Search,
    evidence: Sequence[Evidence],
    hum: Hum | None,
    gaps: Gaps,
    records: Sequence[Record],
) -> tuple[Effect, ...]:
    out, gap_after = [], gaps.final
    for e in evidence:
        element = final.model.element(e.name)
        before = max(_gap(found.compared[e.name].without.model, hum, records), gap_after)
        out.append(_effect(element, e.confidence, e.alternatives, before, gap_after, e))
    if hum is not None:
        element = final.model.element(TONE.name)
        before = float(np.hypot(gap_after, hum.amplitude / np.sqrt(2.0)))
        belief = {1: ONE_RUN, 2: TWO_RUNS}.get(len(records), 0.99)
        out.append(_effect(element, belief, (), before, gap_after, None))
    return tuple(out)


def _gap(model: Model, hum: Hum | None, records: Sequence[Record]) -> float:
    """What a model leaves beside the hum, N rms."""
    rests = [r.measured - predict(model, r)[0] for r in records]
    if hum is not None:
        rests = [e - hum_in(r, e, hum)[r.window] for r, e in zip(records, rests, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(rests) ** 2)))


def _effect(
    element: Element,
    confidence: float,
    alternatives: tuple[tuple[str, float], ...],
    before: float,
    after: float,
    evidence: Evidence | None,
) -> Effect:
    values = {
        spec.name: (p.value, p.std, spec.unit)
        for spec, p in zip(element.spec.parameters, element.parameters, strict=True)
    }
    return Effect(
        element=element.name,
        path=element.spec.path,
        confidence=confidence,
        parameters=values,
        alternatives=alternatives,
        gap_before=before,
        gap_after=after,
        evidence=evidence,
    )


def _remainder(
    verdict: Verdict, found: Search, records: Sequence[Record], regions: Sequence[Region], noise_floor: float
) -> str:
    samples = sum(r.measured.size for r in records)
    noise = float(np.sqrt(np.mean([r.sigma**2 for r in records])))
    size = noise * float(np.sqrt(max(found.excess, 0.0) / samples))
    if verdict == Verdict.NO_DISCREPANCY or (verdict == Verdict.EXPLAINED and size < noise_floor):
        return ""
    if verdict == Verdict.EXPLAINED:
        return f"{size:.3g} N rms stays, no more than the canonical forms of the named effects may miss of real ones"
    if verdict == Verdict.PARTLY_EXPLAINED and size < _NEAR_FLOOR * noise_floor:
        return f"on the fitted runs the named effects leave {size:.3g} N rms beyond the noise"
    where = regions[0].text if regions else "spread over all runs"
    like = describe(records, tangent(found.fit.model, records)).text
    if verdict == Verdict.UNKNOWN_EFFECT:
        near = _nearest(found)
        return f"a repeatable {size:.3g} N rms that no element of the catalogue explains; {where}{near}; {like}"
    return f"a repeatable {size:.3g} N rms stays after the named effects; before them the gap lay {where}; {like}"


def _unseen(verdict: Verdict, held: Gaps, traces: Sequence[Traces]) -> str:
    """What a partly explained gap leaves on runs that no fit has seen, where that is more than it may."""
    if verdict != Verdict.PARTLY_EXPLAINED or _carries_over(held):
        return ""
    rests = {t.record.name: float(np.sqrt(np.mean((t.record.measured - t.final) ** 2))) for t in traces if t.held_out}
    worst = max(rests, key=lambda name: rests[name])
    return (
        f"; on the held-out runs {held.final:.3g} N rms stays where the noise is {held.noise_floor:.3g} N, most of it "
        f"on {worst}: take runs like it into the fit"
    )


def _nearest(found: Search) -> str:
    if not found.moves:
        return ""
    best = min(found.moves[0].rivals, key=lambda t: t.excess)
    title = best.own.spec.title
    return f"; nearest in shape is {title}, but its strength differs from run to run"


def _name(given: Model, names: Sequence[str]) -> str:
    return given.name if not names else f"{given.name} + {', '.join(CATALOGUE[name_of(n)].title for n in names)}"
