"""The fitted values of an effect in words."""

from __future__ import annotations

from identification.report.report_file import Value
from identification.report.values import values_in_words


def test_a_value_comes_with_its_deviation_and_its_unit_and_a_share_without_one() -> None:
    said = values_in_words(
        {"k": Value(value=12000.0, std=300.0, unit="N/m"), "side": Value(value=-0.4, std=None, unit="–")}
    )
    assert said == "k = 1.2e+04 ± 3e+02 N/m, side = -0.4"


def test_what_is_held_at_nothing_is_left_out_and_what_was_fitted_to_nothing_is_not() -> None:
    held, fitted = Value(value=0.0, std=None, unit="–"), Value(value=0.0, std=2.0, unit="N")
    assert values_in_words({"beside_mount": held}) == ""
    assert values_in_words({"beside_mount": held, "F0": fitted}) == "F0: these runs do not determine it"
