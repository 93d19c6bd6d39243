"""Explain a gap: from a base model and measured runs to the names of what the model is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from identification.compute.blas import one_blas_thread
from identification.criteria import BUDGET, FORM
from identification.datachecks import findings_in
from identification.discrepancy.distortion import distortion_of
from identification.discrepancy.excess import excess_of, is_seen
from identification.discrepancy.explanation import Explanation, NextTest, Traces
from identification.discrepancy.final import fit_final, without_harm
from identification.discrepancy.hum import Hum, find_hum, hum_in
from identification.discrepancy.naming import Compared
from identification.discrepancy.nexttest import propose
from identification.discrepancy.notes import (
    beside_mount,
    beyond,
    capped,
    coarse,
    elsewhere,
    far_as_given,
    finer,
    of_runs,
    of_search,
    refit_harms,
    switched_on,
    tared_apart,
    unnamed,
)
from identification.discrepancy.odd import is_odd, odd_run, words_for
from identification.discrepancy.passes import search_in_passes
from identification.discrepancy.preparation import prepared
from identification.discrepancy.unseen import gap_on
from identification.discrepancy.verdict import (
    SearchResult,
    judge,
    test_is_worthwhile,
)
from identification.fitting.leastsquares import Fit, fit_records
from identification.motion_noise import with_motion_noise
from identification.physical.elements import CATALOGUE, TONE
from identification.physical.model import Model, name_of
from identification.physical.predict import predict
from identification.quieter import quieter
from identification.record import Record, compact, noise_without, same_load_cell
from identification.share import fair_shares
from rigctl.runfile import Run

Progress = Callable[[str, float], None]


@one_blas_thread()  # once: of a search in thousands of short tasks a tenth would be spent on setting it
def explain(
    model: Model | None,
    runs: Sequence[Run],
    held_out: Sequence[Run] | None = None,
    *,
    on_progress: Progress | None = None,
) -> Explanation:
    """Find where `model` and the runs disagree, name what is missing, add it, and show the gap that remains.

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
    report = on_progress or (lambda text, done: None)
    report("preparing the runs", 0.0)
    model, train, held = prepared(model, runs, held_out)
    report("fitting the model as given", 0.05)
    base = fit_records(model, [compact(r) for r in train])
    train, held = ([quieter(r, base.model) for r in rs] for rs in (train, held))
    base = fit_records(model, [compact(r) for r in train])
    shows_less = partial(_shows_less_noise, train)
    result = _search(model, base, _find_hum(base.model, train), train, held, report, is_enough=shows_less)
    named = result.found.fit.model
    if result.names and shows_less(result.train, named):
        report("the named effects were part of what was taken for noise: repeating the search", 0.5)
        train, held = ([quieter(r, named) for r in rs] for rs in (train, held))
        base = fit_records(model, [compact(r) for r in train])
        again = partial(_search, model, base, result.hum, train, held, level=named)
        result = again(report=lambda text, done: report(text, max(done, 0.5)))
    if result.hum is not None and result.found.names and _hum_is_gone(result):
        report("the hum was part of a named effect: repeating the search without it", 0.5)
        result = _search(model, base, None, train, held, lambda text, done: report(text, max(done, 0.5)))
    result, odd = _without_odd_run(model, result, train, held, report)
    report("fitting the named effects", 0.8)
    every = [*runs, *(held_out or ())]
    found = _conclude(model, result, odd, findings_in(every), report)
    return replace(found, distortion=distortion_of(every, found.traces))


def _shows_less_noise(records: Sequence[Record], taken: Sequence[Record], model: Model) -> bool:
    """Whether a model leaves less noise of a record than it was `taken` with, by more than its estimate scatters."""
    now = (with_motion_noise(quieter(r, model), model) for r in records)
    return any(r.sigma < (1.0 - FORM.minor) * q.sigma for r, q in zip(now, taken, strict=True))


def _without_odd_run(
    model: Model, result: SearchResult, train: Sequence[Record], held: Sequence[Record], report: Progress
) -> tuple[SearchResult, Record | None]:
    """The result of a search without the run that does not go with the others, and that run, where there is one."""
    odd = odd_run(result)
    if odd is None:
        return result, None
    report(f"most of what is left is in {train[odd].name}: searching again without it", 0.6)
    rest = [r for k, r in enumerate(train) if k != odd]
    base = fit_records(model, [compact(r) for r in rest])
    others = _search(model, base, _find_hum(base.model, rest), rest, held, lambda text, done: None)
    return (others, train[odd]) if is_odd(odd, result, others) else (result, None)


def _search(
    model: Model,
    base: Fit,
    hum: Hum | None,
    train: Sequence[Record],
    held: Sequence[Record],
    report: Progress,
    level: Model | None = None,
    is_enough: Callable[[Sequence[Record], Model], bool] = lambda taken, model: False,
) -> SearchResult:
    """Search for what `base` is missing beside a hum; `level`, or else the base, is the model that tells the noise.

    No further pass is made from a model that `is_enough`, given the records with the noise that they were taken with.
    """
    quiet = _remove_hum(base, hum, train)
    if hum is not None:
        train, held = _estimate_noise(base, hum, train, held)
        quiet = _remove_hum(base, hum, train)
        base = fit_records(model, quiet)
    train, held = ([with_motion_noise(r, level or base.model) for r in rs] for rs in (train, held))
    quiet = [_with_noise_of(q, r) for q, r in zip(quiet, train, strict=True)]
    base = fit_records(base.model, quiet)
    whole, quiet = quiet, fair_shares(quiet, base.residuals)
    if any(p is not q for p, q in zip(quiet, whole, strict=True)):
        base = fit_records(base.model, quiet)
    report("searching for missing effects", 0.2)
    unseen = _remove_hum(base, hum, held)
    only_held_out = not _is_seen(base, quiet) and gap_on(unseen, base, quiet)
    if only_held_out:  # the doubt about their noise is no longer what decides
        whole, quiet = (
            [replace(r, modelled=0.0, independent=1.0, floor_variance=1.0) for r in rs] for rs in (whole, quiet)
        )
    passes = search_in_passes(
        model, base, quiet, unseen, lambda text: report(text, 0.4),
        is_enough=partial(is_enough, train), whole=whole,
    )  # fmt: skip
    return SearchResult(
        base=passes.base, found=passes.found, evidence=passes.evidence, withheld=passes.withheld, hum=hum, train=train,
        held=held, quiet=passes.records, only_held_out=only_held_out, within=passes.within, before=passes.before,
    )  # fmt: skip


def _is_seen(base: Fit, records: Sequence[Record]) -> bool:
    """Whether the fitted runs show a gap."""
    return is_seen(excess_of(base), records)


def _hum_is_gone(result: SearchResult) -> bool:
    """Whether the model with all names leaves no tone, before or after it is fitted to the whole records beside one."""
    without = result.found.fit.model, fit_final(result)[1].without(TONE.name)
    return any(_find_hum(model, result.train) is None for model in without)


def _find_hum(model: Model, train: Sequence[Record]) -> Hum | None:
    """Mains hum that all runs share and the model does not have, or None."""
    if model.has(TONE.name):
        return None
    return find_hum([r.measured - predict(model, r)[0] for r in train], train)


def _remove_hum(base: Fit, hum: Hum | None, train: Sequence[Record]) -> list[Record]:
    """The compact records with the hum taken out."""
    if hum is None:
        return [compact(r) for r in train]
    return [compact(r, hum_in(r, r.measured - predict(base.model, r)[0], hum)) for r in train]


def _estimate_noise(
    base: Fit, hum: Hum, train: Sequence[Record], held: Sequence[Record]
) -> tuple[list[Record], list[Record]]:
    """The records with the noise floor that remains without the hum."""
    every = [*train, *held]
    residuals = [r.measured - predict(base.model, r)[0] for r in every]
    quiet = [noise_without(r, hum_in(r, e, hum)) for r, e in zip(every, residuals, strict=True)]
    quiet = same_load_cell(quiet)
    return quiet[: len(train)], quiet[len(train) :]


def _with_noise_of(quiet: Record, record: Record) -> Record:
    """The compact record with the noise floor of the whole one."""
    return replace(quiet, sigma=compact(record).sigma, independent=record.independent, modelled=record.modelled)


def _conclude(
    given: Model, result: SearchResult, odd: Record | None, findings: Sequence[str], report: Progress
) -> Explanation:
    """The explanation: everything fitted again to the whole records, judged, with the next test and the notes."""
    base = fit_records(result.base.model, result.train, max_iterations=BUDGET.fit_iterations)
    result, final = without_harm(*fit_final(result), base.model)
    traces = [
        _traces(r, given, base.model, final, held_out=held_out)
        for records, held_out in ((result.train, False), (result.held, True))
        for r in records
    ]
    judged = judge(result, final, traces)
    report("designing the next test", 0.95)
    worthwhile, farther = test_is_worthwhile(judged, len(result.train)), beyond(traces)
    next_test = propose(result.found, result.most_doubtful, result.quiet) if worthwhile else NextTest()
    return Explanation(
        verdict=judged.verdict,
        effects=judged.effects,
        withheld=tuple(result.withheld),
        train=judged.train,
        held_out=judged.held_out,
        where=judged.where,
        profiles=judged.profiles,
        repeatable=judged.repeatable,
        remainder=judged.remainder,
        next_test=NextTest(text=farther[0]) if farther else next_test,
        given=given,
        base=base,
        model=replace(_marked(final, result.names), name=_name(given, result.names)),
        moves=result.found.moves,
        compared={name_of(n): _named_for_reader(result.found.compared[n]) for n in result.found.names},
        traces=tuple(traces),
        notes=(*_notes(given, result, final, traces, findings), *_of_odd(odd, final, result)),
        findings=tuple(findings),
    )


def _marked(final: Model, names: Sequence[str]) -> Model:
    """The model that says of which elements a search has named them: the next one, with it as the base, allows these
    the tolerance of form that this one did."""
    return replace(final, elements=tuple(replace(e, named=e.named or e.id in names) for e in final.elements))


def _named_for_reader(compared: Compared) -> Compared:
    """The comparison with names of elements in place of their ids."""
    return replace(compared, beside=tuple(name_of(n) for n in compared.beside))


def _traces(record: Record, given: Model, base: Model, final: Model, *, held_out: bool) -> Traces:
    as_given, refitted, named = (predict(m, record)[0] for m in (given, base, final))
    return Traces(record=record, as_given=as_given, refitted=refitted, final=named, held_out=held_out)


def _notes(
    given: Model, result: SearchResult, final: Model, traces: Sequence[Traces], findings: Sequence[str]
) -> tuple[str, ...]:
    """What the reader should know of the runs and of the model."""
    return (
        *far_as_given(traces),
        *refit_harms(traces),
        *beyond(traces),
        *of_runs(result.train, result.held),
        *elsewhere(result.train, result.held),
        *findings,
        *finer(result.base.model, result.found.fit.model),
        *beside_mount(given, final),
        *switched_on(final),
        *unnamed(result.base.model, final, result.names),
        *of_search(result.as_searched),
        *capped(result.evidence),
        *tared_apart(traces),
        *coarse(final, result.quiet),
    )


def _of_odd(odd: Record | None, final: Model, result: SearchResult) -> tuple[str, ...]:
    return () if odd is None else (words_for(odd, final, result.train),)


def _name(given: Model, names: Sequence[str]) -> str:
    return given.name if not names else f"{given.name} + {', '.join(CATALOGUE[name_of(n)].title for n in names)}"
