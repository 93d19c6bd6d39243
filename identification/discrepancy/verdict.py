"""The verdict after the search: which names are kept, what each closes, and what remains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.criteria import CHANCE, FORM, TEXT
from identification.discrepancy.confidence import confidence_without_rival
from identification.discrepancy.confidence_table import fitted_table
from identification.discrepancy.equation import describe
from identification.discrepancy.evidence import Evidence, beside_withheld, gather, main_doubt
from identification.discrepancy.excess import (
    excess_of,
    form_error,
    is_beyond_steps,
    is_seen,
    material_excess,
    significant_excess,
    solver_error,
    zero_wanders,
)
from identification.discrepancy.explanation import Effect, Gaps, Traces, Verdict, gaps_of
from identification.discrepancy.hum import Hum, hum_in
from identification.discrepancy.naming import Search, fit_others
from identification.discrepancy.signatures import tangent
from identification.discrepancy.where import Region, locate
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.elements import CATALOGUE, TONE
from identification.physical.model import Element, Model, name_of
from identification.physical.predict import predict
from identification.record import Record
from identification.report.page_data import Profile


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchResult:
    """What a search found, and its records: training, held out, and the training records compact and without hum."""

    base: Fit
    found: Search
    evidence: Sequence[Evidence]
    withheld: Sequence[Evidence]  # of names that were dropped as doubtful
    hum: Hum | None
    train: Sequence[Record]
    held: Sequence[Record]
    quiet: Sequence[Record]
    only_held_out: bool = False  # the held-out runs show a gap of the base, the fitted ones do not
    within: Search | None = None  # what a search beside the names found within the tolerance of their forms
    before: Search | None = None  # what an earlier search had named in the base, where it had
    as_searched: bool = (
        False  # the values are those of the search: fitted further, it runs away or the held-out runs are worse
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The id of every named element, that of the hum last."""
        return self.found.names + ((TONE.name,) if self.hum else ())

    @property
    def most_doubtful(self) -> str | None:
        """The name that a further test should settle: the one with the least confidence; where all are sure or none is
        stated, the likeliest of those that are not. None where there is none."""
        unsure = [e for e in self.evidence if e.confidence < TEXT.sure]
        nearest = [e for e in self.withheld if e.name in self.found.compared]
        if nearest and not unsure:
            return max(nearest, key=lambda e: e.confidence).name
        return min(unsure or self.evidence, key=lambda e: e.confidence).name if self.evidence else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """The verdict, and what it rests on."""

    verdict: Verdict
    effects: tuple[Effect, ...]
    train: Gaps
    held_out: Gaps
    where: tuple[Region, ...]
    profiles: tuple[Profile, ...]
    remainder: str

    @property
    def repeatable(self) -> bool:
        """Whether something other than noise remains."""
        return self.verdict in (Verdict.UNKNOWN_EFFECT, Verdict.PARTLY_EXPLAINED)


def drop_doubtful(
    found: Search, records: Sequence[Record], held_out: Sequence[Record]
) -> tuple[Search, list[Evidence], list[Evidence]]:
    """Drop the names with too little confidence and fit the rest again; the evidence for these and for the dropped.

    All evidence is that of the model with all names: what a dropped name leaves behind is no doubt about the others.
    """
    searched, evidence = found, gather(found, records, held_out)
    withheld: list[Evidence] = []
    for weakest in sorted(evidence, key=lambda e: e.confidence):
        if weakest.confidence >= FORM.min_confidence:
            break
        try:
            found = _without(found, weakest.name, records)
        except SimulationError:  # the model can't run without it: it stays there, without a name
            found = replace(found, names=tuple(n for n in found.names if n != weakest.name))
        withheld.append(weakest)
    return found, beside_withheld(searched, [e for e in evidence if e.name in found.names], withheld), withheld


def without_least_confident(result: SearchResult) -> SearchResult:
    """The result without the name of the least confidence, fitted again; without any name where that can't run."""
    weakest = min(result.evidence, key=lambda e: e.confidence)
    try:
        found = _without(result.found, weakest.name, result.quiet)
    except SimulationError:
        found = replace(result.found, fit=result.base, names=(), excess=excess_of(result.base))
    gone = [e for e in result.evidence if e.name not in found.names]
    withheld = [*result.withheld, *gone]
    kept = beside_withheld(result.found, [e for e in result.evidence if e.name in found.names], withheld)
    return replace(result, found=found, evidence=kept, withheld=withheld)


def _without(found: Search, name: str, records: Sequence[Record]) -> Search:
    """The search without a name, fitted again from the best that is known without it.

    Raises
    ------
    SimulationError
        when the model can't run without it.
    """
    start = fit_others(found, name, records)
    rest = fit_records(found.fit.model.in_its_absence(name) if start is None else start.model, records)
    return replace(found, fit=rest, names=tuple(n for n in found.names if n != name), excess=excess_of(rest))


def judge(result: SearchResult, final: Model, traces: Sequence[Traces]) -> Judgement:
    """The judgement of a search, given its model fitted again to the whole records and the traces of every step."""
    train, held = (gaps_of([t for t in traces if t.held_out is kept]) for kept in (False, True))
    verdict = _verdict(result, held)
    residuals = [r.measured - predict(result.base.model, r)[0] for r in result.quiet]
    regions, profiles = locate(residuals, result.quiet)
    stays = [_remainder(verdict, result, regions, train), _held_out_remainder(verdict, result, held, traces)]
    nothing = verdict == Verdict.NO_DISCREPANCY
    return Judgement(
        verdict=verdict,
        effects=() if nothing else _effects(result, final, train),
        train=train,
        held_out=held,
        where=() if nothing else tuple(regions),
        profiles=tuple(profiles),
        remainder="; ".join(text for text in stays if text),
    )


def test_is_worthwhile(judged: Judgement, runs: int) -> bool:
    """Whether a further test is worth its rig time after so many training runs."""
    if judged.verdict == Verdict.NO_DISCREPANCY:
        return runs < TEXT.few_runs
    return judged.verdict != Verdict.EXPLAINED or any(e.confidence < TEXT.sure for e in judged.effects)


def _verdict(result: SearchResult, held: Gaps) -> Verdict:
    if not result.names:
        beyond = is_beyond_steps(result.found.excess, result.found.fit.model, result.quiet)
        gap = beyond and not _within_forms(result)
        return Verdict.UNKNOWN_EFFECT if gap or result.only_held_out else Verdict.NO_DISCREPANCY
    left = result.within is not None or _left_over(result.found, result.hum, result.quiet) or not _carries_over(held)
    return Verdict.PARTLY_EXPLAINED if left else Verdict.EXPLAINED


def _within_forms(result: SearchResult) -> bool:
    """Whether what stays without a new name is what the forms of names of an earlier search may leave."""
    before = result.before
    return before is not None and result.within is None and not _left_over(before, result.hum, result.quiet)


def _left_over(found: Search, hum: Hum | None, records: Sequence[Record]) -> bool:
    """Whether the excess is larger than noise, the form error of the names and of a zero, and the solver explain."""
    samples = sum(r.measured.size for r in records)
    form = form_error(found.fit.model, found.names, records, found.base_excess - found.excess)
    form += zero_wanders(found.fit, records)
    if hum is not None:
        form += FORM.tolerance**2 * sum(0.5 * hum.amplitude**2 * r.measured.size / r.sigma**2 for r in records)
    floor = max(material_excess(records), significant_excess(records), CHANCE.near_floor**2 * samples)
    return found.excess > floor + form and found.excess > floor + form + solver_error(found.fit.model, records)


def _carries_over(held: Gaps) -> bool:
    """Whether the names close the gap on held-out runs: to the noise, or to twice the tolerance of form."""
    return _at_noise(held) or held.closed is None or held.closed > 1.0 - 2.0 * FORM.tolerance


def _at_noise(held: Gaps) -> bool:
    """Whether the held-out runs keep no more than their noise."""
    return held.final**2 < (1.0 + CHANCE.near_floor**2) * held.noise_floor**2


def _effects(result: SearchResult, final: Model, train: Gaps) -> tuple[Effect, ...]:
    """Every name with its values in the final model, and the gap without it and with it."""
    effects = []
    for e in result.evidence:
        element = final.element(e.name)
        without = _gap(result.found.compared[e.name].without.model, result.hum, result.train)
        effects.append(_effect(element, e.confidence, e.alternatives, without, train.final, e))
    if result.hum is not None:
        element = final.element(TONE.name)
        without = float(np.hypot(train.final, result.hum.amplitude / np.sqrt(2.0)))
        belief = confidence_without_rival(len(result.train), fitted_table())
        effects.append(_effect(element, belief, (), without, train.final, None))
    return tuple(effects)


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
    without: float,
    after: float,
    evidence: Evidence | None,
) -> Effect:
    return Effect(
        element=element.name,
        path=element.spec.path,
        confidence=confidence,
        parameters={spec.name: (p.value, p.std, spec.unit) for spec, p in element.told},
        alternatives=alternatives,
        gap_before=max(without, after),
        gap_after=after,
        evidence=evidence,
    )


def _remainder(verdict: Verdict, result: SearchResult, regions: Sequence[Region], train: Gaps) -> str:
    """What stays on the training runs, in words."""
    found, records = result.found, result.quiet
    noise_floor = train.noise_floor
    size = float(np.sqrt(max(train.final**2 - noise_floor**2, 0.0)))
    seen = verdict == Verdict.NO_DISCREPANCY and is_seen(found.excess, records)  # though the forms allow it
    if (verdict == Verdict.NO_DISCREPANCY and not seen) or (verdict == Verdict.EXPLAINED and size < noise_floor):
        return ""
    if verdict == Verdict.EXPLAINED or seen:
        steps = is_seen(found.excess, records) and not is_beyond_steps(found.excess, found.fit.model, records)
        within = "what one step of the solver a sample leaves" if steps else "the tolerance of the canonical forms"
        return f"{size:.3g} N rms stays, within {within}"
    if verdict == Verdict.PARTLY_EXPLAINED and size < CHANCE.near_floor * noise_floor:
        return f"on the fitted runs the named effects leave {size:.3g} N rms beyond the noise"
    if result.only_held_out and not result.names:
        return "on the fitted runs nothing stays beyond the noise"
    where = regions[0].text if regions else "spread over all runs"
    like = describe(records, tangent(found.fit.model, records)).text
    if verdict == Verdict.UNKNOWN_EFFECT:
        near = _nearest(found, result.withheld)
        return f"a repeatable {size:.3g} N rms that no element of the catalogue explains; {where}{near}; {like}"
    near = _within(result) or (_nearest(found, result.withheld) if result.withheld else "")
    return f"a repeatable {size:.3g} N rms stays after the named effects; before them the gap lay {where}{near}; {like}"


def _within(result: SearchResult) -> str:
    """What a search beside the names found, where that may as well be the form of these."""
    if result.within is None:
        return ""
    titles = " and ".join(CATALOGUE[name_of(n)].title for n in result.within.names)
    share = 1.0 - max(result.within.excess, 0.0) / max(result.found.excess, 1e-300)
    return f"; {titles} would close {share:.0%} of it, but the form of the named effects may be what is left"


def _held_out_remainder(verdict: Verdict, result: SearchResult, held: Gaps, traces: Sequence[Traces]) -> str:
    """What stays on held-out runs: more than the noise of an explained gap, of a partly explained one more than is
    allowed, or a gap that only they show."""
    left = f"on the held-out runs {held.final:.3g} N rms stays where the noise is {held.noise_floor:.3g} N"
    if verdict == Verdict.EXPLAINED:
        return "" if _at_noise(held) else left
    partly = verdict == Verdict.PARTLY_EXPLAINED and not _carries_over(held)
    if not partly and (result.names or not result.only_held_out):
        return ""
    rests = {t.record.name: float(np.sqrt(np.mean((t.record.measured - t.final) ** 2))) for t in traces if t.held_out}
    worst = max(rests, key=lambda name: rests[name])
    return f"{left}, most of it on {worst}: take runs like it into the fit"


def _nearest(found: Search, withheld: Sequence[Evidence]) -> str:
    """What came nearest to a name, and why it is not stated."""
    if withheld:
        best = max(withheld, key=lambda e: e.confidence)
        title = CATALOGUE[name_of(best.name)].title
        if best.confidence >= FORM.min_confidence:
            return f"; nearest is {title}, but the held-out runs are worse with it than with the refitted base"
        return f"; nearest is {title}, not stated with a confidence of {best.confidence:.2f}: {main_doubt(best)}"
    drops = [m for m in found.moves if m.kind == "drop"]
    if not drops:
        return ""
    last = drops[-1]
    share = 1.0 - max(last.excess_before, 0.0) / max(last.excess_after, 1e-300)
    title = CATALOGUE[last.name].title
    return f"; nearest in shape is {title}, which closes only {share:.0%} of what is missing without it"
