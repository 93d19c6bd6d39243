"""What is held out, which names are taken back, and what stays in newtons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.criteria import FORM
from identification.discrepancy import verdict
from identification.discrepancy.evidence import gather, main_doubt
from identification.discrepancy.explanation import Traces, Verdict
from identification.discrepancy.final import fit_final, without_harm
from identification.discrepancy.holdout import hold_out
from identification.discrepancy.needless import merge_names
from identification.discrepancy.nexttest import propose
from identification.discrepancy.notes import beyond, capped, elsewhere, far_as_given, of_search, refit_harms
from identification.discrepancy.verdict import SearchResult, _nearest, drop_doubtful
from identification.discrepancy.where import locate
from identification.errors import SimulationError
from identification.physical.beside import switched
from identification.physical.model import element
from identification.record import Record, compact, record_from_run
from rigctl.runfile import with_channel
from tests.identification.specimens import AS_SIMULATED, found_with, records_with, run


def test_a_name_keeps_its_evidence_when_a_doubtful_one_beside_it_is_taken_out() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", "moving_mass", records=records)
    before = {e.name: e for e in gather(found, records, [])}
    assert before["moving_mass"].confidence < FORM.min_confidence <= before["linear_stiffness"].confidence
    kept, stated, withheld = drop_doubtful(found, records, [])
    assert kept.names == kept.fit.model.ids[len(AS_SIMULATED.elements) :] == ("linear_stiffness",)
    assert stated == [before["linear_stiffness"]]
    assert withheld == [before["moving_mass"]]


def test_a_name_that_helps_on_the_fitted_runs_alone_is_doubted() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    [carried], [lost] = gather(found, records[:3], records[3:]), gather(found, records[:3], records_with("none"))
    assert carried.features.left_held_out < 0.05
    assert lost.features.left_held_out > 1.0
    assert lost.confidence < carried.confidence
    [unseen] = gather(found, records[:3], [])
    assert unseen.features.left_held_out == unseen.features.left_beside


def test_what_else_is_missing_where_a_name_does_not_act_is_no_doubt_about_it() -> None:
    runs = [run("end_stop", k, seed=3) for k in range(6)]
    stopped = [compact(record_from_run(runs[k])) for k in (0, 4, 5)]  # beyond the 20 mm at which it stops
    pushed = [with_channel(runs[k], "force", runs[k].channels["force"] + 60.0, "N") for k in (1, 2)]
    found = found_with("end_stop", records=stopped)
    [free] = gather(found, stopped, [compact(record_from_run(r)) for r in pushed])
    assert free.features.left_held_out == free.features.left_beside < 0.1
    reached = with_channel(runs[0], "force", runs[0].channels["force"] + 60.0, "N")
    [acts] = gather(found, stopped, [compact(record_from_run(reached))])
    assert acts.features.left_held_out > free.features.left_held_out


def test_a_doubtful_name_that_the_model_can_not_run_without_is_not_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", "moving_mass", records=records)

    def fails(*_: object, **__: object) -> None:
        raise SimulationError("it runs away")

    monkeypatch.setattr(verdict, "fit_records", fails)
    kept, stated, [mass] = drop_doubtful(found, records, [])
    assert mass.name == "moving_mass"
    assert kept.names == ("linear_stiffness",)
    assert [e.name for e in stated] == ["linear_stiffness"]
    assert kept.fit is found.fit


def test_where_no_name_is_doubtful_nothing_is_fitted_again() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    kept, stated, withheld = drop_doubtful(found, records, [])
    assert kept is found
    assert [e.name for e in stated] == ["linear_stiffness"]
    assert withheld == []


def test_a_name_that_is_not_stated_comes_with_its_largest_doubt() -> None:
    records = records_with("linear_stiffness")
    found, _, [mass] = drop_doubtful(found_with("linear_stiffness", "moving_mass", records=records), records, [])
    steady = replace(
        mass,
        features=replace(mass.features, spread=0.0, left_held_out=0.9, margin=50.0, own_share=1.0),
    )
    assert main_doubt(steady) == "90% of the gap without it stays with it on the held-out runs"
    uneven = replace(
        steady,
        features=replace(steady.features, left_held_out=0.1, spread=3.0),
        strengths=(0.5, 2.0),
        precision=(1.0, 1.0),
    )
    assert main_doubt(uneven).startswith("its strength is 0.50 to 2.00 times the common one from run to run")
    said = _nearest(found, [uneven])
    stated = f"not stated with a confidence of {mass.confidence:.2f}: {main_doubt(uneven)}"
    assert f"mass between load cell and damper, {stated}" in said
    assert "held-out runs are worse with it" in _nearest(found, [replace(uneven, confidence=0.9)])
    assert _nearest(replace(found, moves=()), []) == ""


def test_a_confidence_that_only_more_runs_could_raise_says_so() -> None:
    found = found_with("linear_stiffness", records=records_with("linear_stiffness")[:1])
    [one] = gather(found, records_with("linear_stiffness")[:1], [])
    [told] = capped([one])
    assert told == f"linear stiffness: no confidence above {one.confidence:.2f} is stated for what one run shows"
    assert capped([replace(one, confidence=0.5)]) == []
    records = records_with("linear_stiffness")
    assert capped(gather(found_with("linear_stiffness", records=records), records, [])) == []


def test_a_name_with_which_a_held_out_run_cannot_be_simulated_is_doubted_and_that_is_its_reason() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    motion = replace(records[0].motion, x=1e306 * records[0].motion.x)
    [evidence] = gather(found, records, [replace(records[0], motion=motion)])
    assert evidence.confidence < FORM.min_confidence
    assert main_doubt(evidence) == "the model with it can't run on the held-out runs"


def test_a_test_does_not_tell_an_element_from_itself() -> None:
    result = result_of("linear_stiffness", "moving_mass")
    doubtful = str(result.most_doubtful)
    compared = result.found.compared[doubtful]
    twice = replace(compared, rivals=(*compared.rivals, replace(compared.rivals[0], excess=2.0)))
    found = replace(result.found, compared={**result.found.compared, doubtful: twice})
    assert propose(found, doubtful, result.quiet) == propose(result.found, doubtful, result.quiet)


def test_the_run_that_alone_reaches_farthest_is_not_held_out() -> None:
    records = [record_from_run(run("none", 2, seed=s)) for s in range(8)]
    for k in range(8):
        far = [stretched(r, 1.5) if n == k else r for n, r in enumerate(records)]
        train, held = hold_out(far)
        assert far[k] in train
        assert len(held) == 2
    train, held = hold_out([stretched(r, 1.0 + 0.2 * n) for n, r in enumerate(records)])
    assert len(held) == 2


def stretched(record: Record, by: float) -> Record:
    motion = replace(record.motion, x=by * record.motion.x, v=by * record.motion.v, a=by * record.motion.a)
    return replace(record, motion=motion)


def test_a_model_in_other_units_is_told_apart_from_a_missing_effect() -> None:
    [record, *_] = records_with("none")

    def given(factor: float) -> Traces:
        force = record.measured
        return Traces(record=record, as_given=factor * force, refitted=force, final=force, held_out=False)

    assert far_as_given([given(0.3)]) == []
    [said] = far_as_given([given(1000.0)])
    assert "units" in said


def test_a_held_out_run_in_another_band_is_told() -> None:
    records = records_with("none")
    assert elsewhere(records, records[3:]) == []
    fast = replace(records[3], name="fast", motion=replace(records[3].motion, v=100.0 * records[3].motion.v))
    [said] = elsewhere(records, [fast])
    assert said.startswith("fast (held out) moves at about")


def trace(of: Record, gap: float, held_out: bool) -> Traces:
    final = of.measured + gap
    return Traces(record=of, as_given=final, refitted=final, final=final, held_out=held_out)


@pytest.mark.parametrize(("stretched", "left", "is_told"), [(2.0, 50.0, True), (1.0, 50.0, False), (2.0, 5.0, False)])
def test_a_held_out_run_that_shows_a_gap_where_no_fitted_one_has_been_is_told(
    stretched: float, left: float, is_told: bool
) -> None:
    [record, *_] = records_with("none")
    far = replace(record, name="far", motion=replace(record.motion, x=stretched * record.motion.x))
    said = beyond([trace(record, 5.0, False), trace(far, left, True)])
    assert [note.startswith("far (held out) moves from") for note in said] == [True] * is_told


@pytest.mark.parametrize(
    ("current", "fitted", "is_told"),
    [(0.0, (0.25, 1.0), True), (1.0, (1.0, 1.0), False), (0.5, (1.0, 1.0), True), (0.5, (0.0, 1.0), False)],
)
def test_a_held_out_run_that_shows_a_gap_at_a_current_that_no_fitted_one_had_is_told(
    current: float, fitted: tuple[float, float], is_told: bool
) -> None:
    [record, *_] = records_with("none")

    def at(i: float) -> Record:
        return replace(record, name="other", motion=replace(record.motion, i=np.full(record.motion.i.size, i)))

    said = beyond([*(trace(at(i), 5.0, False) for i in fitted), trace(at(current), 50.0, True)])
    assert [note.startswith("other (held out) has a current of") for note in said] == [True] * is_told


def result_of(*names: str) -> SearchResult:
    """A search that ends with these names, judged on a specimen with a spring."""
    records = records_with("linear_stiffness")
    found, evidence, withheld = drop_doubtful(found_with(*names, records=records), records, [])
    return SearchResult(
        base=found.fit, found=found, evidence=evidence, withheld=withheld, hum=None, train=records, held=[],
        quiet=records,
    )  # fmt: skip


@pytest.mark.parametrize(("left", "is_told"), [(0.5, False), (4.0, True)])
def test_what_an_explained_gap_leaves_on_held_out_runs_beyond_their_noise_is_told(left: float, is_told: bool) -> None:
    result = result_of("linear_stiffness")

    def traced(record: Record, gap: float, held_out: bool) -> Traces:
        far = record.measured + 500.0 * record.sigma
        final = record.measured + gap * record.sigma
        return Traces(record=record, as_given=far, refitted=far, final=final, held_out=held_out)

    traces = [traced(r, 1.0, False) for r in result.train[:3]] + [traced(result.train[3], left, True)]
    judged = verdict.judge(result, result.found.fit.model, traces)
    assert judged.verdict == Verdict.EXPLAINED
    stays = f"on the held-out runs {left * result.train[3].sigma:.3g} N rms stays"
    assert (stays in judged.remainder) is is_told


@pytest.mark.parametrize("ran_away", [False, True])
def test_a_model_that_runs_away_when_it_is_fitted_further_is_left_as_the_search_found_it(ran_away: bool) -> None:
    result = result_of("linear_stiffness")
    searched, base = result.found.fit.model, result.found.fit.model.without("linear_stiffness")
    spring = searched.element("linear_stiffness")
    stiff = [replace(p, value=30.0 * p.value) if not p.fixed else p for p in spring.parameters]
    further = searched.replacing("linear_stiffness", replace(spring, parameters=tuple(stiff))) if ran_away else searched
    now, final = without_harm(replace(result, held=result.train), further, base)
    assert now.as_searched is ran_away
    assert now.names == ("linear_stiffness",)
    assert final.element("linear_stiffness").value("k") == spring.value("k")
    assert bool(of_search(now.as_searched)) is ran_away


def test_a_model_that_can_not_run_along_the_whole_records_is_taken_back() -> None:
    """A hysteresis that grows without end within their stroke: the search saw pieces of less."""
    result = result_of("linear_stiffness")
    grows = element("bouc_wen", {"alpha": 1.0, "A": 1.0, "n": 2.0, "beta": -1e9, "gamma": 0.0})
    model = result.found.fit.model
    found = replace(result.found, fit=replace(result.found.fit, model=model.with_element(grows)))
    away = replace(result, found=found, held=result.train)
    kept, model = fit_final(away)
    assert kept.as_searched
    assert model.has("bouc_wen")
    now, final = without_harm(kept, model, result.base.model)
    assert not now.as_searched
    assert now.names == ()
    assert final == result.base.model


@pytest.mark.parametrize("mounted", [False, True])
def test_nothing_that_was_found_acts_beside_a_mount_that_is_not_there(mounted: bool) -> None:
    result = result_of("linear_stiffness")
    spring = result.found.fit.model.element("linear_stiffness")
    place = spring.spec.index("beside_mount")
    beside = result.found.fit.model.replacing(spring.id, switched(spring, place))
    model = beside.with_element(element("series_compliance", {"k": 1e7, "c": 0.0})) if mounted else beside
    found = replace(result.found, fit=replace(result.found.fit, model=model))
    _, final = fit_final(replace(result, base=replace(result.base, model=AS_SIMULATED), found=found))
    assert final.element(spring.id).value("beside_mount") == float(mounted)


def test_where_every_stated_name_is_sure_the_next_test_is_about_the_nearest_that_is_not() -> None:
    result = result_of("linear_stiffness", "moving_mass")
    assert result.names == ("linear_stiffness",)
    assert result.most_doubtful == "moving_mass"
    unsure = [replace(e, confidence=0.6) for e in result.evidence]
    assert replace(result, evidence=unsure).most_doubtful == "linear_stiffness"
    assert replace(result, withheld=[]).most_doubtful == "linear_stiffness"
    assert replace(result, withheld=[], evidence=[]).most_doubtful is None


def test_a_test_for_a_name_that_is_not_stated_sets_it_against_its_rival_or_the_model_without_it() -> None:
    result = result_of("linear_stiffness", "moving_mass")
    text = propose(result.found, result.most_doubtful, result.quiet).text
    assert "mass between load cell and damper" in text


def test_a_test_on_which_two_models_hardly_differ_beside_the_noise_is_not_proposed() -> None:
    result = result_of("linear_stiffness", "moving_mass")
    loud = [replace(r, sigma=1e4 * r.sigma) for r in result.quiet]
    proposed = propose(result.found, result.most_doubtful, loud)
    assert proposed.design == {}
    assert "no test within the motion seen so far" in proposed.text


def test_a_gap_that_is_even_over_a_variable_points_nowhere() -> None:
    records = records_with("none")
    rng = np.random.default_rng(4)
    regions, _ = locate([3.0 * r.sigma * rng.standard_normal(r.measured.size) for r in records], records)
    assert regions[0].text.startswith("nearly even over ")


def test_a_refit_that_makes_held_out_runs_worse_is_told() -> None:
    [record] = records_with("none")[:1]
    off = Traces(record=record, as_given=record.measured + 10.0, refitted=record.measured + 20.0,
                 final=record.measured, held_out=True)  # fmt: skip
    [note] = refit_harms([off])
    assert "10 N as given and by 20 N once it is fitted" in note
    assert refit_harms([replace(off, refitted=record.measured + 12.0)]) == []
    assert refit_harms([replace(off, held_out=False)]) == []


@pytest.mark.parametrize(("sign", "names"), [(-1.0, ("gas_spring",)), (1.0, ("force_offset", "linear_stiffness"))])
def test_an_offset_and_a_spring_that_are_one_gas_spring_get_its_name(sign: float, names: tuple[str, ...]) -> None:
    """A gas behind a rod pushes it out and stiffens as it goes in; pulled in, it is none."""
    runs = [run("none", k, seed=3) for k in (0, 1, 2, 4)]
    gas = [sign * 150.0 * (1.0 - sign * r.channels["displacement"] / 0.2) ** -1.15 for r in runs]
    records = [
        compact(record_from_run(with_channel(r, "force", r.channels["force"] + f, "N")))
        for r, f in zip(runs, gas, strict=True)
    ]
    found = found_with("force_offset", "linear_stiffness", records=records)
    merged = merge_names(found, records)
    assert merged.names == names
    assert merged.excess < found.excess + 0.05 * merged.base_excess
