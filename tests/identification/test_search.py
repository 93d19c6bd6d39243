"""The search from other starts, on specimens whose curves are not those of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from identification.criteria import CHANCE
from identification.discrepancy import naming, search
from identification.discrepancy.choice import Trial
from identification.discrepancy.excess import excess_of, material_excess, significant_excess
from identification.discrepancy.naming import Search
from identification.fitting.leastsquares import fit_records
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, element
from identification.record import Record
from tests.identification.specimens import AS_SIMULATED as BASE
from tests.identification.specimens import found_with, records_with


def first_trials() -> tuple[list[Record], Search, list[Trial]]:
    """Records of a machine with a mass that the base lacks, the search before any name, and what was tried first."""
    records, bare, found = _first_trials()
    return list(records), bare, list(found)


@cache  # nobody changes a search or a trial
def _first_trials() -> tuple[tuple[Record, ...], Search, tuple[Trial, ...]]:
    records = records_with("moving_mass")
    base = fit_records(BASE, records)
    bare = Search(fit=base, names=(), excess=excess_of(base), given=BASE, base_excess=excess_of(base))
    return tuple(records), bare, tuple(naming.trials(base, BASE, records))


@pytest.mark.slow
def test_where_a_name_led_nowhere_the_second_choice_is_tried() -> None:
    records, bare, found = first_trials()
    wrong = max(found, key=lambda t: t.excess)
    astray = naming.add_name(bare, wrong, found, records)
    other = search._second_choice(bare, astray, astray.names, records)
    assert other is not None
    assert other.names == ("moving_mass",)
    assert search._second_choice(bare, astray, [t.name for t in found], records) is None, "nothing else was tried"
    assert naming.steps(astray) == [(bare, astray)]


def test_the_second_choice_is_not_the_first_one_where_another_name_has_taken_its_place_since() -> None:
    records, bare, found = first_trials()
    right = next(t for t in found if t.name == "moving_mass")
    since = naming.add_name(bare, right, found, records)
    other = search._second_choice(bare, since, ["another_name"], records)
    assert other is None or other.names != since.names


@pytest.mark.slow
def test_nothing_takes_the_place_of_a_refused_name_that_is_far_better() -> None:
    records, bare, found = first_trials()
    refuses = replace(bare, refused=frozenset({"moving_mass"}))
    assert naming.improve_once(refuses, records) is None
    near = [t.name for t in found if t.name != "moving_mass" and t.excess < 0.9 * bare.excess]
    assert near, "others would have closed something"
    no_better = replace(bare, refused=frozenset({max(found, key=lambda t: t.excess).name}))
    improved = naming.improve_once(no_better, records)
    assert improved is not None
    assert improved.names == ("moving_mass",)


def test_where_a_search_from_another_start_ended_is_kept_beside_what_it_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    records, bare, found = first_trials()
    wrong, right = (f(found, key=lambda t: t.excess) for f in (max, min))
    ends = [naming.add_name(bare, t, found, records) for t in (wrong, right)]
    monkeypatch.setattr(search, "search_from", lambda *_: ends.pop(0))
    monkeypatch.setattr(search, "other_starts", lambda *_: iter([("once more", bare)]))
    best = search.search(BASE, bare.fit, records, is_enough=lambda model: model.has(right.name))
    assert best.names == (right.id,)
    assert [other.names for other in best.others] == [(wrong.id,)]


@pytest.mark.slow
def test_a_search_ends_where_another_one_has_been_unless_it_fits_better() -> None:
    records = records_with("moving_mass")
    base = fit_records(BASE, records)
    there = Search(fit=base, names=(BASE.ids[0],), excess=excess_of(base), given=BASE, base_excess=excess_of(base))
    assert naming.search_from(there, records, str, [there]) is there
    assert naming.search_from(there, records, str, [replace(there, excess=1.5 * there.excess)]).names != there.names


def test_a_search_ends_where_another_one_closed_more_with_as_many_names() -> None:
    records = records_with("moving_mass")
    base = fit_records(BASE, records)
    here = Search(fit=base, names=BASE.ids[:2], excess=excess_of(base), given=BASE, base_excess=excess_of(base))
    ahead = replace(here, names=("moving_mass", "force_delay"), excess=0.5 * here.excess)
    assert naming.search_from(here, records, str, [ahead]) is here
    assert not naming._is_behind(ahead, here)
    assert not naming._is_behind(here, replace(ahead, names=("moving_mass",))), "with fewer names it says nothing"
    first, alone = (replace(s, names=s.names[:1]) for s in (here, ahead))
    assert not naming._is_behind(first, alone), "a first name that closes less may lead further"


def test_what_is_held_near_its_given_value_gets_its_own_limits_back() -> None:
    own = replace(BASE.elements[0].parameters[0], low=600.0)
    valve = Element("valve_damping", (own, *BASE.elements[0].parameters[1:]))
    given = replace(BASE, elements=(valve, BASE.elements[1]))
    held = search.limit_base(given)
    soft, firm = held.elements[0].parameters[:2]
    assert (soft.low, soft.high) == (600.0, 2700.0)
    assert (firm.low, firm.high) == (700.0, 6300.0)
    alpha, alpha_control, _, delta, *_ = held.elements[1].parameters
    assert alpha.high == 150.0
    assert alpha_control.high is None, "what is given as nothing has no size to be held to"
    assert delta.high is None, "what is fixed stays as it is"
    records = records_with("none")[:1]
    fit = fit_records(held, records, max_iterations=1)
    freed = search.restore_limits(Search(fit=fit, names=(), excess=0.0, given=held), given).fit.model
    limits = [(p.low, p.high) for e in freed.elements for p in e.parameters]
    assert limits == [(p.low, p.high) for e in given.elements for p in e.parameters]
    assert (freed.values() == fit.model.values()).all()


@pytest.mark.slow
def test_a_base_that_has_bent_too_far_is_held_near_what_was_given() -> None:
    records = records_with("linear_stiffness")
    given = BASE.with_values([*BASE.values()[:7], 8.0, *BASE.values()[8:]])  # a friction five times as blunt as it is
    assert given.elements[1].value("beta") == 8.0
    base = fit_records(given, records)
    assert base.model.elements[1].value("beta") > 24.0
    bare = search.start_state(given, base, records)  # from which no name was found, say
    ((text, start),) = search.other_starts(bare, given, base, records)
    assert "near its given values" in text
    assert start.names == ("linear_stiffness",)
    assert start.fit.model.elements[1].value("beta") <= 24.0
    near = search.start_state(BASE, fit_records(BASE, records), records)
    assert not list(search.other_starts(near, BASE, near.fit, records)), "a base that is near needs no holding"


@pytest.mark.parametrize(("enough", "searches"), [(False, 2), (True, 1)])
def test_from_other_starts_nothing_is_sought_beside_a_model_that_is_enough(
    enough: bool, searches: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    records = records_with("linear_stiffness")
    base = fit_records(BASE, records, max_iterations=1)
    begun = list[Search]()

    def found_nothing(start: Search, *_: object) -> Search:
        begun.append(start)
        return start

    def one_more(last: Search, *_: object) -> Iterator[tuple[str, Search]]:
        yield "from where it was", last

    monkeypatch.setattr(search, "search_from", found_nothing)
    monkeypatch.setattr(search, "other_starts", one_more)
    found = search.search(BASE, base, records, is_enough=lambda model: enough)
    assert (found.names, len(begun)) == ((), searches)


def test_a_trial_that_sticks_says_nothing_against_a_name_that_fits() -> None:
    records, bare, found = first_trials()
    right = min(found, key=lambda t: t.excess)
    state = naming.add_name(bare, right, found, records)
    lost = replace(bare.fit, model=right.fit.model)
    stuck = [replace(t, fit=lost, excess=bare.excess) if t.name == right.name else t for t in found]
    again = naming.repeat_trials(state, right.name, records, trials=lambda *_, **__: stuck)
    assert again.names == ("moving_mass",)
    own = [t for t in again.compared["moving_mass"].rivals if t.name == "moving_mass"]
    assert [t.excess for t in own] == [state.excess]
    assert min(again.compared["moving_mass"].rivals, key=lambda t: t.excess) is own[0]


@pytest.mark.parametrize("beside", ["presliding_friction", "linear_stiffness"])
def test_a_dry_friction_takes_the_place_of_a_name_only_where_no_other_one_is_named(beside: str) -> None:
    records = records_with("two_frictions")[:2]
    loop = element("bouc_wen", {"alpha": 1e3, "A": 1.0, "n": 1.0, "beta": 1e3, "gamma": 1e3})
    values = {"presliding_friction": {"sigma": 1e5, "f_c": 20.0}, "linear_stiffness": {"k": 500.0}}[beside]
    fit = fit_records(BASE.with_element(loop).with_element(element(beside, values)), records)
    compared = naming.Compared(without=fit, start=fit, beside=(beside,), rivals=())
    state = Search(
        fit=fit, names=(beside, "bouc_wen"), excess=excess_of(fit), given=BASE, compared={"bouc_wen": compared}
    )
    again = naming.repeat_trials(state, "bouc_wen", records)
    tried = {t.name for one in again.compared.values() for t in one.rivals} | set(again.names)
    frictions = {"coulomb_friction", "stribeck_friction", "lugre_friction"}
    assert bool(tried & frictions) is (beside == "linear_stiffness")


@pytest.mark.parametrize(
    ("found", "other", "taken"),
    [(5.0, 0.5, True), (5.0, 2.0, False), (40.0, 2.0, True), (40.0, 15.0, False), (1.2, 0.9, False)],
)
def test_of_two_answers_that_come_near_only_a_whole_one_replaces_the_first(
    found: float, other: float, taken: bool
) -> None:
    """In units of what matters at least, of a gap of 100: what leaves less than 10 comes near."""
    records = records_with("none")[:1]
    least = max(material_excess(records), significant_excess(records))
    fit = fit_records(BASE, records, max_iterations=1)
    first, second = (
        Search(fit=fit, names=(), excess=e * least, given=BASE, base_excess=100.0 * least) for e in (found, other)
    )
    assert search.is_better(second, first, records) == taken


def test_a_start_that_was_taken_already_is_not_taken_again() -> None:
    records, bare, found = first_trials()
    wrong = max(found, key=lambda t: t.excess)
    base, last = bare.fit, replace(naming.add_name(bare, wrong, found, records), excess=0.0)
    assert [start.names for _, start in search.other_starts(last, base.model, base, records)] == [("moving_mass",)]
    tried = replace(last, dead_end=frozenset({"moving_mass"}))
    assert not list(search.other_starts(tried, base.model, base, records))


def test_a_fit_without_one_name_is_never_worse_than_the_search_was_with_fewer() -> None:
    records, bare, found = first_trials()
    mass = next(t for t in found if t.name == "moving_mass")
    named = naming.add_name(bare, mass, found, records)
    assert named.names == ("moving_mass",)
    lost = named.fit.model  # a further name has bent the base so far that no fit finds back from there
    off = {"tanh_hysteresis.alpha": 1e9, "tanh_hysteresis.beta": 1e-7, "valve_damping.c_soft": 1.0}
    lost = lost.with_values([off.get(n, v) for n, v in zip(lost.names(), lost.values(), strict=True)])
    lost = lost.with_element(element("linear_stiffness", {"k": 1e3}))
    beside = replace(named, fit=replace(named.fit, model=lost), names=("moving_mass", "linear_stiffness"), before=named)
    rest = naming.fit_without(beside.fit, "linear_stiffness", records)
    assert rest is not None
    assert excess_of(rest) > 2.0 * abs(named.excess), "the case is one of another minimum"
    others = naming.fit_others(beside, "linear_stiffness", records)
    assert others is not None
    assert excess_of(others) <= named.excess + CHANCE.slack
    alone = naming.fit_others(beside, "moving_mass", records)
    assert alone is not None
    assert excess_of(alone) <= bare.excess + CHANCE.slack


def test_what_was_refused_or_dropped_is_not_added_again(monkeypatch: pytest.MonkeyPatch) -> None:
    records, bare, found = first_trials()
    monkeypatch.setattr(naming, "trials", lambda *_, **__: found)
    drop = naming.Move(kind="drop", name="moving_mass", excess_before=0.0, excess_after=0.0, rivals=())
    for state, named in (
        (bare, True),
        (replace(bare, refused=frozenset({"moving_mass"})), False),
        (replace(bare, moves=(drop,)), False),
    ):
        improved = naming.improve_once(state, records)
        assert (improved is not None and "moving_mass" in improved.names) == named


def test_what_is_missing_without_a_name_is_no_more_than_the_search_left_without_both() -> None:
    records, bare, found = first_trials()
    mass = next(t for t in found if t.name == "moving_mass")
    named = naming.add_name(bare, mass, found, records)
    harmful = element("linear_stiffness", {"k": 4e4}, ("k",))  # alone it can only do harm, and no fit can move it
    both = replace(
        named, fit=fit_records(named.fit.model.with_element(harmful), records),
        names=("moving_mass", "linear_stiffness"), before=bare,
    )  # fmt: skip
    rest = naming.fit_others(both, "moving_mass", records)
    assert rest is not None
    assert excess_of(rest) > 2.0 * bare.excess, "the case is one of a name that does harm alone"
    tried = naming.repeat_trials(both, "moving_mass", records, trials=lambda *_, **__: [])
    assert tried.compared["moving_mass"].without is bare.fit


def test_a_search_ends_where_it_has_been(monkeypatch: pytest.MonkeyPatch) -> None:
    records = records_with("moving_mass")
    one, other = (found_with(name, records=records) for name in ("force_offset", "linear_stiffness"))
    asked: list[tuple[str, ...]] = []

    def back_and_forth(state: Search, _: object) -> Search:
        asked.append(state.names)
        return other if state.names == one.names else one

    monkeypatch.setattr(naming, "improve_once", back_and_forth)
    last = naming.search_from(one, records, str)
    assert asked == [one.names, other.names]
    assert last.names == one.names


@pytest.mark.slow
@pytest.mark.parametrize("closes", [True, False])
def test_a_further_name_still_closes_much_after_simpler_ones_took_the_place_of_others(closes: bool) -> None:
    records = records_with("linear_stiffness")
    state = found_with("moving_mass", records=records)
    useless = found_with("moving_mass", "force_offset", records=records)

    def revise(improved: Search, _: object) -> Search:
        return improved if closes else useless

    assert (naming.improve_once(state, records, revise=revise) is not None) == closes


@pytest.mark.slow
def test_a_name_must_close_as_much_as_is_asked_of_it() -> None:
    _, bare, found = first_trials()
    records = records_with("moving_mass")
    best = min(found, key=lambda t: t.excess)
    closes = 1.0 - best.excess / bare.excess
    assert naming.improve_once(replace(bare, helps=0.5 * closes), records) is not None
    assert naming.improve_once(replace(bare, helps=0.5 * (1.0 + closes)), records) is None


def test_beside_a_friction_that_an_earlier_search_has_named_none_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    records = records_with("coulomb_friction")
    named = found_with("coulomb_friction", records=records)
    tried = list[set[str]]()
    inner = naming.trials

    def watched(*arguments: object, **options: object) -> list[Trial]:
        found = inner(*arguments, **options)
        tried.append({t.name for t in found})
        return found

    monkeypatch.setattr(naming, "trials", watched)
    bare = Search(fit=fit_records(BASE, records), names=(), excess=named.base_excess, given=BASE)
    naming.improve_once(bare, records)
    beside = replace(named, names=(), earlier=named.names, base_excess=named.excess, before=None, compared={}, moves=())
    naming.improve_once(beside, records)
    assert "coulomb_friction" in tried[0]
    assert len(tried) == 2, "one round, and not a second one without frictions"
    assert not {t for t in tried[1] if CATALOGUE[t].friction}
