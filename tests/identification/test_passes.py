"""The search in passes: what one hands to the next."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from identification.discrepancy.evidence import gather
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search
from identification.discrepancy.passes import search_in_passes
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model
from identification.record import Record, compact, record_from_run
from rigctl.runfile import with_channel
from tests.identification.specimens import AS_SIMULATED as BASE
from tests.identification.specimens import found_with, records_with, run

PASSES = sys.modules["identification.discrepancy.passes"]


class Told:
    """In the place of a pass: the answers that are given, one a pass, and what each pass was told to refuse."""

    def __init__(self, *answers: tuple[Any, ...]) -> None:
        self.answers = list(answers)
        self.refused: list[list[str]] = []

    def __call__(
        self, given: Model, base: Any, earlier: Any, refused: Any, *_: Any
    ) -> tuple[Any, ...]:  # Any: the signature of a pass
        self.refused.append(list(refused))
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
