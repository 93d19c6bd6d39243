"""The units that nearly every file holds are converted without pint, and as pint converts them."""

from __future__ import annotations

from itertools import product

import pytest

from rigctl.foreign_files import units


@pytest.mark.parametrize(("one", "other"), list(product(units._USUAL, repeat=2)))
def test_a_usual_unit_is_what_pint_says(one: str, other: str) -> None:
    of_pint, own = units._linear_by_pint(one, other), units._linear(one, other)
    assert (own is None) == (of_pint is None)
    assert own is None or own == pytest.approx(of_pint, rel=1e-12)
