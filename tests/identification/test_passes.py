"""The search in passes: what one hands to the next."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from identification.criteria import FORM
from identification.discrepancy.evidence import gather
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search, append_name, gap_remains
from identification.discrepancy.passes import search_in_passes
from identification.discrepancy.search import NOTHING, Beside, search
from identification.discrepancy.trials import trial_of
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import Record, compact, record_from_run
from rigctl.runfile import with_channel
from tests.identification.ordinary import motion, recorded
from tests.identification.specimens import AS_SIMULATED as BASE
from tests.identification.specimens import found_with, records_with, run

PASSES = sys.modules["identification.discrepancy.passes"]


class Told:
    """In the place of a pass: the answers that are given, one a pass, and what each pass was told to begin beside."""

    def __init__(self, *answers: tuple[Any, ...]) -> None:
        self.answers = list(answers)
        self.asked: list[Beside] = []

    @property
    def refused(self) -> list[list[str]]:
        return [list(beside.refused) for beside in self.asked]

    def __call__(
        self, given: Model, base: Any, beside: Beside, *_: Any
    ) -> tuple[Any, ...]:  # Any: the signature of a pass
        self.asked.append(beside)
        return self.answers.pop(0) if self.answers else (replace(self.last, names=()), [], [])

    last: Search


def in_passes(
    told: Told, records: list[Record], monkeypatch: pytest.MonkeyPatch, enough: Callable[[Model], bool]
) -> tuple[Search, list[str]]:
    told.last = told.answers[-1][0]
    monkeypatch.setattr(PASSES, "one_pass", told)
    found = search_in_passes(BASE, fit_records(BASE, records), records, records, str, is_enough=enough)
    return found.found, [e.name for e in found.evidence]


def gas_records() -> list[Record]:
    """A machine with a gas behind its rod, which pushes it out and stiffens as it goes in."""
    runs = [run("none", k, seed=3) for k in (0, 1, 2, 4)]
    gas = [-150.0 * (1.0 + r.channels["displacement"] / 0.2) ** -1.15 for r in runs]
    with_gas = (with_channel(r, "force", r.channels["force"] + f, "N") for r, f in zip(runs, gas, strict=True))
    return [compact(record_from_run(r)) for r in with_gas]


@pytest.mark.slow
def test_parts_of_one_cause_that_two_passes_found_get_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    records = gas_records()
    first = found_with("force_offset", records=records)
    both = found_with("force_offset", "linear_stiffness", records=records)
    only = {"linear_stiffness": both.compared["linear_stiffness"]}
    second = replace(both, names=("linear_stiffness",), earlier=("force_offset",), compared=only)
    told = Told((first, gather(first, records, records), []), (second, gather(second, records, records), []))
    found, stated = in_passes(told, records, monkeypatch, lambda model: False)
    assert found.names == ("gas_spring",)
    assert stated == ["gas_spring"]


@pytest.mark.parametrize(("remains", "most"), [(False, 1), (True, FORM.most_effects)])
def test_within_the_forms_of_the_names_one_more_is_sought_at_a_time(
    remains: bool, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    records = records_with("moving_mass")
    found = found_with("force_offset", records=records)
    monkeypatch.setattr(PASSES, "gap_remains", lambda *_: remains)
    told = Told((found, gather(found, records, records), []))
    in_passes(told, records, monkeypatch, lambda model: False)
    assert [beside.most for beside in told.asked] == [FORM.most_effects, most]


@pytest.mark.slow
def test_a_search_adds_no_more_names_than_it_may() -> None:
    runs = [run("moving_mass", k, seed=3) for k in (0, 1, 2, 4)]
    records = [compact(record_from_run(with_channel(r, "force", r.channels["force"] + 6.0, "N"))) for r in runs]
    base = fit_records(BASE, records)
    assert len(search(BASE, base, records).names) == 2
    assert len(search(BASE, base, records, beside=Beside(most=1)).names) == 1


def test_no_pass_is_made_from_a_model_that_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    records = records_with("linear_stiffness")
    first = found_with("force_offset", records=records)
    told = Told((first, gather(first, records, records), []))
    found, stated = in_passes(told, records, monkeypatch, lambda model: model.has("force_offset"))
    assert (found.names, stated, len(told.refused)) == (("force_offset",), ["force_offset"], 1)
    again = Told((first, gather(first, records, records), []))
    in_passes(again, records, monkeypatch, lambda model: False)
    assert len(again.refused) == 2


@pytest.mark.parametrize(("been", "refused"), [(True, ["linear_stiffness"]), (False, [])])
def test_what_a_search_found_from_the_names_that_stand_is_refused_in_the_next_pass(
    been: bool, refused: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    records = records_with("moving_mass")
    both = found_with("force_offset", "linear_stiffness", records=records)
    alone = found_with("force_offset" if been else "linear_stiffness", records=records)
    withheld = [e for e in gather(both, records, records) if e.name == "linear_stiffness"]
    rest = fit_records(both.fit.model.without("linear_stiffness"), records)
    stands = replace(both, names=("force_offset",), fit=rest, excess=excess_of(rest), before=alone)
    told = Told((stands, gather(both, records, records)[:1], withheld))
    in_passes(told, records, monkeypatch, lambda model: False)
    assert told.refused == [[], refused]


def after_a_step(found: Search, better: Search) -> Search:
    return replace(found, before=better)


def beside_another_start(found: Search, better: Search) -> Search:
    return replace(found, others=(better,))


@pytest.mark.slow
@pytest.mark.parametrize("where", [after_a_step, beside_another_start])
def test_names_that_leave_much_less_than_what_stands_of_the_search_take_their_place(
    where: Callable[[Search, Search], Search], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mass, of which most is made, was exchanged for an offset beside a spring, or another start has come to it; and
    the spring does not stand."""
    runs = [run("moving_mass", k, seed=3) for k in (0, 1, 2, 4)]
    records = [compact(record_from_run(with_channel(r, "force", r.channels["force"] + 6.0, "N"))) for r in runs]
    mass, both = (found_with(*n, records=records) for n in (("moving_mass",), ("force_offset", "linear_stiffness")))
    base, found = fit_records(BASE, records), [both, where(both, mass)]
    monkeypatch.setattr(PASSES, "search", lambda *_, **__: found.pop(0))
    alone, (stands, evidence, _) = (PASSES.one_pass(BASE, base, NOTHING, records, records, str) for _ in range(2))
    assert alone[0].names == ("force_offset",)
    assert stands.names == ("moving_mass",)
    assert [e.name for e in evidence] == ["moving_mass"]


def test_each_pass_looks_where_what_it_starts_from_fails_most(monkeypatch: pytest.MonkeyPatch) -> None:
    first, elsewhere = records_with("linear_stiffness")[:2], records_with("moving_mass")[:2]
    found = found_with("force_offset", records=first)
    told = Told((found, gather(found, first, first), []))
    told.last = found
    monkeypatch.setattr(PASSES, "one_pass", told)
    passes = search_in_passes(BASE, fit_records(BASE, first), first, first, str, whole=elsewhere)
    fitted = fit_records(found.fit.model, elsewhere)
    assert [id(r) for r in passes.records] == [id(r) for r in elsewhere]
    assert passes.found.excess == pytest.approx(excess_of(fitted))
    assert passes.found.base_excess == pytest.approx(excess_of(fit_records(BASE, elsewhere)))
    assert excess_of(passes.found.compared["force_offset"].without) > passes.found.excess


@pytest.mark.slow
def test_an_effect_that_acts_where_the_first_pass_has_not_looked_is_found() -> None:
    runs = [run("end_stop", k, seed=3) for k in range(6)]
    pushed = [with_channel(r, "force", r.channels["force"] + 60.0, "N") for r in runs]
    records = [compact(record_from_run(r)) for r in pushed]
    free, stopped = records[1:4], [records[k] for k in (0, 4, 5)]  # below and above the 20 mm at which it stops
    base = fit_records(BASE, free)
    blind = search_in_passes(BASE, base, free, free, str)
    found = search_in_passes(BASE, base, free, stopped, str, whole=stopped)
    assert set(blind.found.names) == {"force_offset"}
    assert set(found.found.names) == {"force_offset", "end_stop"}


def departing(seed: int) -> Record:
    """20 s of a spring beside a dashpot that is a fifth stiffer for one of them: 0.2 % of its energy over the whole."""
    t, x, v = motion(seed, 0.02, seconds=20.0)
    stiffer = 1.0 + 0.2 * ((t > 9.0) & (t < 10.0))
    return compact(record_from_run(recorded("spring", seed, x, 900.0 * v + 5000.0 * stiffer * x, noise=1.0)))


@pytest.mark.parametrize(("confidence", "counts"), [(None, False), (0.89, False), (0.95, True)])
def test_a_departure_of_form_is_no_larger_where_a_pass_has_looked_for_it_and_what_is_sure_is_none(
    confidence: float | None, counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = [departing(k) for k in range(4)]
    dashpot = Model(name="m", elements=(element("viscous_damping", {"c": 800.0, "c_control": 0.0}, ("c_control",)),))
    base = fit_records(dashpot, whole)
    sprung = fit_records(base.model.with_element(element("linear_stiffness", {"k": 4000.0})), whole)
    massed = fit_records(sprung.model.with_element(element("moving_mass", {"m": 0.1})), whole)
    spring = trial_of(sprung, "linear_stiffness", base, whole, 1.0)
    mass = trial_of(massed, "moving_mass", sprung, whole, 1.0)
    bare = Search(fit=base, names=(), excess=excess_of(base), given=dashpot, base_excess=excess_of(base))
    found = append_name(bare, spring, [spring])
    more = replace(append_name(found, mass, [mass]), names=("moving_mass",), earlier=("linear_stiffness",))
    [new] = gather(more, whole, whole)
    new = new if confidence is None else replace(new, confidence=confidence)
    told = Told((found, gather(found, whole, whole), []), (more, [new], []))
    told.last = more
    monkeypatch.setattr(PASSES, "one_pass", told)
    passes = search_in_passes(dashpot, base, whole, whole, str, whole=whole)
    assert passes.found.names == (("linear_stiffness", "moving_mass") if counts else ("linear_stiffness",))
    if counts:
        return
    assert sum(r.measured.size for r in passes.records) < 0.5 * sum(r.measured.size for r in whole)
    assert gap_remains(passes.found, passes.records), "the case is one of pieces that were chosen for what is left"
    assert passes.within is more


def test_a_name_that_shares_its_effect_with_a_later_one_stands_without_that(monkeypatch: pytest.MonkeyPatch) -> None:
    records = records_with("linear_stiffness")
    alone = found_with("force_offset", records=records)
    earlier = found_with("force_offset", "linear_stiffness", records=records)
    last = replace(found_with("force_offset", "linear_stiffness", "moving_mass", records=records), before=earlier)
    shared = [e for e in gather(last, records, records) if e.name != "force_offset"]
    judged = {3: (alone, [], shared), 2: (earlier, gather(earlier, records, records), [])}
    monkeypatch.setattr(PASSES, "search", lambda *_, **__: last)
    monkeypatch.setattr(PASSES, "drop_doubtful", lambda found, *_: judged[len(found.names)])
    monkeypatch.setattr(PASSES, "merge_names", lambda found, _: found)
    stands, stated, withheld = PASSES.one_pass(BASE, fit_records(BASE, records), NOTHING, records, records, str)
    assert stands.names == ("force_offset", "linear_stiffness")
    assert [e.name for e in stated] == ["force_offset", "linear_stiffness"]
    assert withheld == []


def test_what_lies_within_the_form_of_the_names_is_asked_for_more_than_a_minor_part(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    asked = list[Beside]()

    def told(given: Model, base: Any, beside: Beside, *_: Any) -> tuple[Any, ...]:  # Any: the signature of a pass
        asked.append(beside)
        return (found if len(asked) == 1 else replace(found, names=()), [], [])

    monkeypatch.setattr(PASSES, "one_pass", told)
    monkeypatch.setattr(PASSES, "is_seen", lambda excess, records: True)
    for gap in (True, False):
        asked.clear()
        monkeypatch.setattr(PASSES, "gap_remains", lambda search, records, gap=gap: gap)
        search_in_passes(BASE, fit_records(BASE, records), records, records, str)
        assert [b.helps for b in asked] == [FORM.helps, FORM.helps if gap else FORM.minor]
        assert [b.earlier for b in asked] == [(), found.names]
