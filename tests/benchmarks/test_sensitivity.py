"""Half and double of a number that decides hold for as long as they are asked for, and what they change is told."""

from __future__ import annotations

import pytest

from benchmarks.explain.sensitivity import changed, differences
from identification.criteria import FORM

NAMED = {"kind": "pair", "seed": 7, "names": {"free_play": 0.9, "gas_spring": 0.8}, "verdict": "explained"}


def test_a_number_is_changed_for_a_while_and_then_as_before() -> None:
    before = FORM.most_effects, FORM.tolerance
    with changed(FORM, "tolerance", 2.0), changed(FORM, "most_effects", 0.5):
        assert (FORM.most_effects, FORM.tolerance) == (2, pytest.approx(2.0 * before[1]))
    assert before == (FORM.most_effects, FORM.tolerance)


def test_other_names_and_verdicts_are_told_and_of_the_rest_the_largest_change_of_a_confidence() -> None:
    less_sure = {**NAMED, "names": {"free_play": 0.9, "gas_spring": 0.7}}
    unnamed = {**NAMED, "names": {}, "verdict": "unknown_effect"}
    assert differences([NAMED, NAMED], [NAMED, less_sure]) == "confidences to 0.10"
    assert differences([NAMED], [unnamed]) == (
        "pair 7: free_play, gas_spring (explained) → no name (unknown_effect); confidences to 0.00"
    )


def test_a_case_that_fails_is_told_with_its_error() -> None:
    failed = {"kind": "pair", "seed": 7, "error": "the force became infinite"}
    assert differences([NAMED], [failed]).endswith("→ no name (the force became infinite); confidences to 0.00")
