"""Which elements are rivals of a name: those tried in its place, a name that is not stated in the end among them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.discrepancy.naming import Move, Search
from identification.discrepancy.rivals import rivals_of
from identification.discrepancy.trials import trial_of
from identification.discrepancy.verdict import drop_doubtful
from identification.fitting.leastsquares import fit_records
from identification.physical.model import element
from tests.identification.specimens import AS_SIMULATED, found_with, records_with

STATED, OTHER = "linear_stiffness", "moving_mass"


@pytest.fixture(scope="module")
def both() -> Search:
    """A search that named a spring where a mass had been tried as well, and then the mass beside it."""
    records = records_with(STATED)
    start = fit_records(AS_SIMULATED, records)
    first = (element(STATED, {"k": 2000.0}), element(OTHER, {"m": 0.1}))
    fits = [fit_records(AS_SIMULATED.with_element(e), records) for e in first]
    tried = tuple(trial_of(f, e.id, start, records, screened=1.0) for f, e in zip(fits, first, strict=True))
    step = Move(kind="add", name=STATED, excess_before=0.0, excess_after=tried[0].excess, rivals=tried)
    return replace(found_with(STATED, OTHER, records=records), moves=(step,))


def test_a_withheld_name_that_was_tried_where_a_stated_one_was_chosen_is_a_rival_of_that(both: Search) -> None:
    [rival] = rivals_of(both, STATED, withheld=(OTHER,))
    chosen, other = both.moves[0].rivals
    assert rival.name == OTHER
    assert other.excess > chosen.excess
    assert rival.behind > 0.0


def test_a_name_that_is_stated_too_is_no_rival(both: Search) -> None:
    assert rivals_of(both, STATED) == []


def test_a_withheld_name_is_a_rival_as_last_compared_before_what_an_earlier_step_says_of_it(both: Search) -> None:
    chosen, other = both.moves[0].rivals
    near = replace(other, excess=chosen.excess)
    compared = replace(both.compared[STATED], rivals=(chosen, near))
    found = replace(both, compared={**both.compared, STATED: compared})
    assert rivals_of(found, STATED) == []
    [rival] = rivals_of(found, STATED, withheld=(OTHER,))
    assert rival.behind == 0.0


def test_a_withheld_name_that_was_chosen_before_a_stated_one_is_no_rival_of_what_that_closed_later(
    both: Search,
) -> None:
    [step] = both.moves
    earlier = replace(step, name=OTHER, excess_after=step.rivals[1].excess)
    assert rivals_of(replace(both, moves=(earlier,)), STATED, withheld=(OTHER,)) == []


def test_a_withheld_name_is_among_the_alternatives_of_one_that_is_stated(both: Search) -> None:
    [step] = both.moves
    chosen, other = step.rivals
    as_good = replace(step, rivals=(chosen, replace(other, excess=chosen.excess)))
    two = records_with(STATED)[:2]  # of which no name is sure
    _, [spring], [mass] = drop_doubtful(replace(both, moves=(as_good,)), two, [])
    assert (spring.name, mass.name) == (STATED, OTHER)
    [(name, share)] = spring.alternatives
    assert name == OTHER
    assert 0.0 < share < 1.0 - spring.confidence
