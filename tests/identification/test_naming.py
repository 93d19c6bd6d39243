"""The naming workflow on specimens whose curves are not those of the catalogue."""

from __future__ import annotations

import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from identification.criteria import FORM
from identification.discrepancy import Verdict, explain, naming, report_data, write_report
from identification.discrepancy.aliases import aliases
from identification.discrepancy.choice import Trial, is_mistaken
from identification.discrepancy.curves import interval_of_rms
from identification.discrepancy.excess import contribution, excess_of, form_error
from identification.discrepancy.needless import drop_departures
from identification.discrepancy.notes import coarse, unnamed
from identification.discrepancy.search import search
from identification.errors import DataError
from identification.fitting import fit
from identification.fitting.leastsquares import fit_records
from identification.models import simulate_run
from identification.models.measures import score_signals
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, Model, element
from identification.physical.modelfile import read_model
from identification.record import Record, compact, record_from_run
from rigctl.runfile import with_channel
from tests.identification.specimens import campaign, run

BASE = Model(
    name="as simulated today",
    elements=(
        element("valve_damping", {"c_soft": 900, "c_firm": 2100, "u_soft": 0.3, "u_firm": 1.6, "w_knee": 0.6}),
        element("tanh_hysteresis", {"alpha": 50, "alpha_control": 0, "beta": 40, "delta": 0.0}),
    ),
)


def scaled(model: Model, factor: float) -> Model:
    values = [v * factor if n.split(".")[1] in ("c_soft", "c_firm", "alpha") else v
              for n, v in zip(model.names(), model.values(), strict=True)]  # fmt: skip
    return model.with_values(values)


LONGER = ("linear_stiffness", "moving_mass", "force_delay", "end_stop")


@pytest.mark.parametrize(
    "effect",
    ["coulomb_friction", "damping_asymmetry", *(pytest.param(e, marks=pytest.mark.slow) for e in LONGER)],
)
def test_a_hidden_effect_is_named_and_the_gap_closes_on_runs_no_fit_has_seen(effect: str) -> None:
    train, held = campaign(effect, seed=3)
    found = explain(BASE, train, held)
    assert [f.element for f in found.effects] == [effect]
    assert found.verdict == Verdict.EXPLAINED
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.9
    assert found.effects[0].confidence > 0.5


@pytest.mark.slow
def test_names_that_do_not_close_the_gap_on_unseen_runs_explain_it_only_in_part() -> None:
    train, held = campaign("linear_stiffness", seed=3)
    x = held[0].channels["displacement"]
    worn = with_channel(held[0], "force", held[0].channels["force"] + 4e9 * x**5, "N")
    found = explain(BASE, train, [worn])
    assert [e.element for e in found.effects] == ["linear_stiffness"]
    assert found.held_out.closed is not None
    assert 0.0 < found.held_out.closed < 0.88
    assert found.verdict == Verdict.PARTLY_EXPLAINED
    assert f"held-out runs {found.held_out.final:.3g} N rms stays" in found.remainder
    assert worn.run_id in found.remainder


@pytest.mark.bench
def test_a_second_look_with_what_was_found_as_the_base_finds_nothing() -> None:
    train, held = campaign("linear_stiffness", seed=3)
    worn = [
        with_channel(
            r, "force", r.channels["force"] + 60.0 * np.tanh(50.0 * np.gradient(r.channels["displacement"], 1e-3)), "N"
        )
        for r in (*train, *held)
    ]
    first = explain(BASE, worn[:5], worn[5:])
    assert "linear_stiffness" in [e.element for e in first.effects]
    again = explain(first.model, worn[:5], worn[5:])
    assert again.effects == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    ["coulomb_friction", *(pytest.param(e, marks=pytest.mark.bench) for e in ("moving_mass", "damping_asymmetry"))],
)  # a curve over velocity is tried with more others beside an offset: twice as long
def test_the_run_that_was_not_tared_is_named_and_the_others_are_explained_without_it(effect: str) -> None:
    train, held = campaign(effect, seed=3)
    train[2] = with_channel(train[2], "force", train[2].channels["force"] + 200.0, "N")
    found = explain(BASE, [*train[:3], train[4]], held)  # without the second sine: half the time
    assert [e.element for e in found.effects] == [effect]
    assert found.verdict == Verdict.EXPLAINED
    [said] = [note for note in found.notes if "does not go with the other runs" in note]
    assert said.startswith(train[2].run_id)
    assert "a mean of 200 N" in said
    assert train[2].run_id not in report_data(found)["runs"]["train"]


@pytest.mark.slow
def test_names_with_which_unseen_runs_are_worse_than_with_the_base_are_taken_back() -> None:
    train, held = campaign("linear_stiffness", seed=3)
    x = held[0].channels["displacement"]
    other = with_channel(held[0], "force", held[0].channels["force"] - 6000.0 * x, "N")
    found = explain(BASE, train, [other])
    assert found.effects == ()
    assert found.verdict == Verdict.UNKNOWN_EFFECT
    assert found.held_out.final <= found.held_out.base_refitted * 1.001
    assert "of the gap without it stays with it on the held-out runs" in found.remainder
    stays = np.sqrt(found.train.final**2 - found.train.noise_floor**2)
    assert f"a repeatable {stays:.3g} N rms" in found.remainder  # the newtons of the ladder
    [taken_back] = found.withheld
    assert taken_back.name == "linear_stiffness"
    assert taken_back.features.left_held_out > 1.0


@pytest.mark.slow
def test_of_names_that_leave_a_part_each_that_closes_much_stays() -> None:
    runs = [run("moving_mass", k, seed=3) for k in (0, 2)]
    rub = [14.0 * np.sin(2 * np.pi * r.channels["displacement"] / 0.004) for r in runs]  # of which nothing is known
    forces = [r.channels["force"] + 4000.0 * r.channels["displacement"] + e for r, e in zip(runs, rub, strict=True)]
    records = [compact(record_from_run(with_channel(r, "force", f, "N"))) for r, f in zip(runs, forces, strict=True)]
    found = search(BASE, fit_records(BASE, records), records)
    assert not naming.explains(found)
    assert {"linear_stiffness", "moving_mass"} <= set(found.names)
    for name in found.names:
        without = excess_of(found.compared[name].without)
        assert found.excess < (1.0 - FORM.closes) * without


@pytest.mark.slow
def test_a_search_that_leads_no_further_goes_on_from_the_better_fit_it_had_passed_over() -> None:
    runs = [run("moving_mass", k, seed=3) for k in (0, 2)]
    runs = [with_channel(r, "force", r.channels["force"] + 2e4 * r.channels["displacement"], "N") for r in runs]
    records = [compact(record_from_run(r)) for r in runs]
    base = fit_records(BASE, records)
    found = naming.trials(base, BASE, records)
    worst = max(found, key=lambda t: t.excess)
    tried = naming.Compared(without=base, start=base, beside=(), rivals=tuple(found))
    stuck = naming.Search(fit=worst.fit, names=(worst.name,), excess=worst.excess, given=BASE,
                          base_excess=excess_of(base), compared={worst.name: tried})  # fmt: skip
    otherwise = naming._swap_in_better_fit(stuck)
    assert otherwise is not None
    grown = naming.improve_once(otherwise, records)
    assert grown is not None
    assert sorted(grown.names) == ["linear_stiffness", "moving_mass"]
    assert [m.kind for m in grown.moves] == ["swap", "add"]
    since = replace(stuck, names=(worst.name, "force_offset"))  # what was tried without a name says nothing beside it
    assert naming._swap_in_better_fit(since) is None
    best = min(found, key=lambda t: t.excess)
    assert naming._swap_in_better_fit(replace(stuck, fit=best.fit, names=(best.name,), excess=best.excess)) is None


@pytest.mark.slow
def test_an_effect_is_named_on_top_of_a_simulation_of_any_other_program() -> None:
    theirs = fit(BASE, campaign("none", seed=3)[0]).model
    train, held = (
        [with_channel(r, "force_simulated", simulate_run(theirs, r), "N") for r in runs]
        for runs in campaign("linear_stiffness", seed=3)
    )
    found = explain(None, train, held)
    assert [f.element for f in found.effects] == ["linear_stiffness"]
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.9
    assert any("out of reach" in note for note in found.notes)


@pytest.mark.slow
def test_of_two_of_a_kind_the_one_that_was_missing_is_named(tmp_path: Path) -> None:
    theirs = fit(BASE, campaign("none", seed=3)[0]).model
    train, held = (
        [
            with_channel(
                with_channel(r, "force_simulated", simulate_run(theirs, r), "N"),
                "force",
                r.channels["force"] + 400.0 * np.gradient(r.channels["displacement"], 1.0 / r.sample_rate_hz),
                "N",
            )
            for r in runs
        ]
        for runs in campaign("none", seed=3)
    )
    found = explain(None, train, held)
    (effect,) = found.effects
    assert effect.element == "viscous_damping"
    assert effect.evidence is not None
    assert effect.evidence.name == "viscous_damping#2"
    assert found.model.ids == ("viscous_damping", "viscous_damping#2")
    assert found.model.element("viscous_damping#2").value("c") == pytest.approx(400.0, rel=0.02)
    assert list(found.compared) == ["viscous_damping"]
    write_report(found, tmp_path, reproduce="")
    assert read_model(tmp_path / "model.json").ids == found.model.ids


@pytest.mark.slow
def test_a_load_cell_that_was_tared_between_the_runs_is_told() -> None:
    train, held = campaign("none", seed=3)
    channels = dict(train[0].channels)
    channels["force"] = channels["force"] + 60.0
    found = explain(BASE, [replace(train[0], channels=channels), *train[1:]], held)
    assert any("tared" in note for note in found.notes)
    assert not any("tared" in note for note in explain(BASE, train, held).notes)


def test_a_numerical_error_that_could_be_taken_for_an_effect_is_told() -> None:
    record = record_from_run(campaign("none", seed=3)[0][0])
    loose = BASE.with_element(element("free_play", {"gap": 1e-3}))
    assert coarse(BASE, [record]) == []
    [note] = coarse(loose, [replace(record, sigma=1e-3 * record.sigma)])
    assert "one step a sample leaves a numerical error" in note


def test_a_run_without_the_simulation_that_is_asked_for_is_refused() -> None:
    train, _ = campaign("none", seed=3)
    with pytest.raises(DataError, match="no channel 'force_simulated'"):
        explain(None, train)


def test_nothing_hidden_is_no_discrepancy() -> None:
    found = explain(BASE, *campaign("none", seed=4))
    assert found.verdict == Verdict.NO_DISCREPANCY
    assert found.effects == ()


def test_an_effect_outside_the_catalogue_gets_no_name() -> None:
    found = explain(BASE, *campaign("cogging", seed=5))
    assert found.verdict == Verdict.UNKNOWN_EFFECT
    assert found.effects == ()
    assert found.remainder != ""


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-4, pytest.param(1e4, marks=pytest.mark.bench)])
def test_the_name_does_not_depend_on_the_scale_of_the_force(scale: float) -> None:
    train, held = campaign("linear_stiffness", seed=6, scale=scale)
    found = explain(scaled(BASE, scale), train, held)
    assert [f.element for f in found.effects] == ["linear_stiffness"]


def test_a_fit_meets_the_noise_from_starts_a_third_off() -> None:
    runs, _ = campaign("none", seed=7)
    near, far = fit(BASE, runs), fit(scaled(BASE, 1.3), runs)
    assert far.converged
    assert [near.rms, far.rms] == pytest.approx([3.0, 3.0], rel=0.05)  # the noise of the specimen


def test_the_noise_floor_is_that_of_the_load_cell_even_where_the_force_drifts() -> None:
    clean = run("none", 0, 8)
    drift = np.linspace(0.0, 200.0, clean.samples)
    drifting = replace(clean, channels={**clean.channels, "force": clean.channels["force"] + drift})
    assert record_from_run(clean).sigma == pytest.approx(3.0, rel=0.05)
    assert record_from_run(drifting).sigma == pytest.approx(3.0, rel=0.1)


class _Page(HTMLParser):
    """Collects what a page would load from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.outside: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("src", "href") and value and not value.startswith(("#", "data:")):
                self.outside.append(value)


@pytest.mark.slow
def test_the_report_is_one_offline_page_and_its_model_reads_back(tmp_path: Path) -> None:
    train, held = campaign("linear_stiffness", seed=9)
    found = explain(BASE, train, held)
    page = write_report(found, tmp_path, reproduce="damper-rig explain model.json")
    parser = _Page()
    parser.feed(page.read_text(encoding="utf-8"))
    assert parser.outside == []
    assert found.train.final == found.effects[0].gap_after < found.effects[0].gap_before
    assert found.effects[0].gap_before < 1.01 * found.train.base_refitted  # less where its curves were refined
    assert json.loads((tmp_path / "report.json").read_text()) == json.loads(json.dumps(report_data(found)))
    model = read_model(tmp_path / "model.json")
    force = simulate_run(model, held[0])
    settled = slice(held[0].period_samples, None)
    rms = score_signals(held[0].channels["force"][settled], force[settled]).rms
    assert rms < 1.1 * found.held_out.noise_floor
    assert sorted(p.name for p in tmp_path.iterdir()) == ["evidence.h5", "model.json", "report.html", "report.json"]


def test_the_interval_of_a_gap_holds_what_it_is_the_gap_of() -> None:
    rng = np.random.default_rng(4)
    size = (400, 3, 20, 50)  # draws, records, stretches, samples
    drawn = rng.normal(size=size) * rng.gamma(9.0, 1.0, size=(400, 3, 20, 1)) ** 0.5
    ends = np.array([interval_of_rms([list(record) for record in one]) for one in drawn])
    holds = (ends[:, 0] < 3.0) & (ends[:, 1] > 3.0)
    assert 0.90 < np.mean(holds) < 0.98
    assert interval_of_rms([[np.full(5, 2.0)]]) == (2.0, 2.0)


def test_runs_that_do_not_belong_together_are_refused_by_name() -> None:
    one, two = run("none", 0, 1), run("none", 1, 1)
    with pytest.raises(DataError, match="runs of different specimens are mixed"):
        explain(BASE, [one, replace(two, specimen="another")])
    with pytest.raises(DataError, match="is the same run as"):
        explain(BASE, [one, one])
    reversed_sign = replace(two, channels={**two.channels, "force": -two.channels["force"]})
    with pytest.raises(DataError, match="sign of force or displacement is reversed"):
        explain(BASE, [one, reversed_sign])
    with pytest.raises(DataError, match="no run was given"):
        explain(BASE, [])
    passive = {k: v for k, v in two.channels.items() if k != "current"}
    with pytest.raises(DataError, match="has no control current, which 'valve_damping'"):
        explain(BASE, [one, replace(two, channels=passive)])


@pytest.mark.slow
def test_a_simulation_equal_to_the_measurement_has_the_highest_score() -> None:
    force = run("none", 0, 2).channels["force"]
    figures = score_signals(force, force)
    assert figures.rms == 0.0
    assert figures.fit == 100.0
    assert figures.eearth == pytest.approx(1.0)


def dry_frictions(state: naming.Search) -> int:
    return sum(state.fit.model.element(n).spec.dry_friction for n in state.names)


@pytest.mark.slow
@pytest.mark.parametrize("revised", [True, False])
def test_two_dry_frictions_in_one_machine_are_given_one_name(revised: bool) -> None:
    """A seal with its breakaway and a guide that turns over gently: no one form is both, swapped or not."""
    records = [compact(record_from_run(r)) for r in campaign("two_frictions", seed=6)[0]]
    base = fit_records(BASE, records)
    rubbed = fit_records(base.model.with_element(element("coulomb_friction", {"f_c": 40.0})), records)
    state = naming.Search(
        fit=rubbed, names=("coulomb_friction",), excess=excess_of(rubbed), given=BASE, base_excess=excess_of(base)
    )
    revise = naming.revise_names if revised else (lambda found, records: found)
    if not revised:
        added = naming._add_best(state, records, revise=revise)
        assert added is not None
        assert dry_frictions(added) == 2
    grown = naming.improve_once(state, records, revise)
    assert grown is not None
    assert dry_frictions(grown) == 1


def test_an_effect_that_looks_like_a_fault_of_the_rig_comes_with_the_test_that_splits_them() -> None:
    sensors = {n for n, spec in CATALOGUE.items() if spec.path == "sensor" and spec.starts is not None}
    assert all(CATALOGUE[n].alias is not None for n in sensors)
    mass = CATALOGUE["moving_mass"]
    assert mass.alias is not None
    assert aliases(["coulomb_friction", "moving_mass"]) == [
        f"{mass.title}: {mass.alias.cause} would look the same in every run; to tell them apart, {mass.alias.test}"
    ]


def test_what_the_model_has_and_no_name_says_is_told() -> None:
    joint = (element("free_play", {"gap": 1e-4}), element("series_compliance", {"k": 2e7, "c": 0.0}))
    valve = (element("control_delay", {"tau": 8e-3}), element("control_lag", {"tau": 1e-3}))
    worn = Model(name="worn", elements=(*valve, *BASE.elements, *joint))
    told = unnamed(BASE, worn, ("free_play", "control_delay"))
    assert [text in " ".join(told) for text in ("2e+07 N/m", "0.001 s")] == [True, True]
    assert len(told) == 2
    assert unnamed(BASE, worn, [e.name for e in worn.elements]) == unnamed(worn, worn, ()) == []


@pytest.mark.parametrize(("gap", "is_none"), [(1e-9, True), (1e-3, False)])
def test_a_joint_that_gives_way_more_than_it_plays_is_a_compliance(gap: float, is_none: bool) -> None:
    records = [compact(record_from_run(run("none", 0, 1)))]
    worn = BASE.with_element(element("free_play", {"gap": gap}))
    bushed = worn.with_element(element("series_compliance", {"k": 1e6, "c": 0.0}))
    fit = fit_records(BASE, records, max_iterations=1)
    force = float(np.sqrt(np.mean(records[0].measured ** 2)))
    trial = Trial(id="free_play", fit=replace(fit, model=worn), excess=0.0, contribution=1.0,
                  formed=1.0, parameters=1, means_left=0.0, screened=1.0, closed=1.0, measured=1.0,
                  force=force, stroke=0.02, swing=0.0, speed=1.0, slow=0.1, current=0.0)  # fmt: skip
    assert is_mistaken(trial) is is_none
    assert not is_mistaken(replace(trial, fit=replace(fit, model=bushed)))


@pytest.mark.parametrize(("half", "side", "is_spring"), [(2.0, 0.0, False), (8.0, 0.0, True), (8.0, 0.8, False)])
def test_air_that_no_force_presses_far_on_either_side_is_a_spring(half: float, side: float, is_spring: bool) -> None:
    """`half` of the air is gone at so many times the rms force, on the side of the smaller area at 1 − `side` of it."""
    records = [compact(record_from_run(run("none", 0, 1)))]
    fit = fit_records(BASE, records, max_iterations=1)
    force = 100.0
    air = BASE.with_element(element("aerated_oil", {"air": 1e-2, "f_half": half * force, "side": side}))
    trial = Trial(id="aerated_oil", fit=replace(fit, model=air), excess=0.0, contribution=1.0,
                  formed=1.0, parameters=2, means_left=0.0, screened=1.0, closed=1.0, measured=1.0,
                  force=force, stroke=0.02, swing=0.0, speed=1.0, slow=0.1, current=0.0)  # fmt: skip
    assert is_mistaken(trial) is is_spring


@pytest.mark.parametrize(("n", "share", "is_spring"), [(1.0, 0.1, True), (1.0, 0.5, False), (2.5, 0.1, True)])
def test_a_hysteresis_that_comes_back_the_way_it_went_is_a_spring(n: float, share: float, is_spring: bool) -> None:
    """`share` of its slope is lost at half the stroke."""
    records = [compact(record_from_run(run("none", 0, 1)))]
    fit = fit_records(BASE, records, max_iterations=1)
    gamma = 2.0 * share / (2.0 * 0.01) ** n
    loop = BASE.with_element(element("bouc_wen", {"alpha": 1e4, "A": 2.0, "n": n, "beta": 0.0, "gamma": gamma}))
    trial = Trial(id="bouc_wen", fit=replace(fit, model=loop), excess=0.0, contribution=1.0,
                  formed=1.0, parameters=4, means_left=0.0, screened=1.0, closed=1.0, measured=1.0,
                  force=1.0, stroke=0.02, swing=0.0, speed=1.0, slow=0.1, current=0.0)  # fmt: skip
    assert is_mistaken(trial) is is_spring


@pytest.mark.parametrize(("swing", "is_none"), [(0.02, True), (0.5, False)])
def test_a_hysteresis_of_the_control_that_no_run_crosses_is_none(swing: float, is_none: bool) -> None:
    """What is left of the current before a run is free in every run: a different current in each would fit anything."""
    records = [compact(record_from_run(run("none", 0, 1)))]
    fit = fit_records(BASE, records, max_iterations=1)
    still = BASE.with_element(element("control_hysteresis", {"h": 0.1}))
    trial = Trial(id="control_hysteresis", fit=replace(fit, model=still), excess=0.0, contribution=1.0,
                  formed=1.0, parameters=1, means_left=0.0, screened=1.0, closed=1.0, measured=1.0,
                  force=1.0, stroke=0.02, swing=swing, speed=1.0, slow=0.1, current=0.0)  # fmt: skip
    assert is_mistaken(trial) is is_none


@pytest.mark.parametrize("closed", [-1.0, 0.0, 1e3, 1e9])
def test_what_may_be_the_form_of_a_name_is_bounded_by_what_the_name_closes(closed: float) -> None:
    records = [compact(record_from_run(run("none", 0, 1)))]
    form = form_error(BASE, ["tanh_hysteresis"], records, closed)
    assert 0.0 <= form <= 4.0 * FORM.tolerance**2 * max(closed, 0.0)
    assert form <= FORM.tolerance**2 * contribution(BASE, "tanh_hysteresis", records)


def as_found(*added: Element) -> tuple[naming.Search, list[Record]]:
    """What a search that ends with these elements stands on; the runs hold none of them."""
    records = [compact(record_from_run(run("none", 0, seed=3)))]
    model = BASE
    for e in added:
        model = model.with_element(e)
    fitted = fit_records(model, records, max_iterations=1)
    names = tuple(e.name for e in added)
    return naming.Search(fit=replace(fitted, model=model), names=names, excess=excess_of(fitted), given=BASE), records


@pytest.mark.parametrize(("k", "named"), [(1e7, False), (8e4, True)])
def test_how_the_halves_of_a_joint_with_play_meet_is_no_effect_of_its_own(k: float, named: bool) -> None:
    play, seat = element("free_play", {"gap": 1e-3}), element("series_compliance", {"k": k, "c": 0.0})
    state, records = as_found(play, seat)
    rest = naming.fit_without(state.fit, "series_compliance", records)
    assert rest is not None
    whole = replace(state, excess=excess_of(rest) - 0.5 * contribution(state.fit.model, "free_play", records))
    assert drop_departures(whole, records).names == (("free_play", "series_compliance") if named else ("free_play",))
    of_no_account = replace(state, excess=excess_of(rest))
    assert drop_departures(of_no_account, records).names == ("free_play",)


@pytest.mark.parametrize(
    ("lag", "delay", "names"),
    [
        (0.002, 0.010, ("control_delay",)),
        (0.010, 0.002, ("control_lag",)),
        (0.008, 0.010, ("control_lag", "control_delay")),
    ],
)
def test_a_lag_that_only_smears_a_dead_time_is_no_effect_of_its_own(
    lag: float, delay: float, names: tuple[str, ...]
) -> None:
    state, records = as_found(element("control_lag", {"tau": lag}), element("control_delay", {"tau": delay}))
    assert drop_departures(state, records).names == names
