"""What matters of a gap is a share of the force that changes: a preload makes nothing unimportant."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.discrepancy.excess import material_excess
from tests.identification.specimens import records_with


@pytest.mark.parametrize("preload", [0.0, 3e3, -3e5])
def test_a_preload_makes_no_gap_too_small_to_matter(preload: float) -> None:
    records = records_with("end_stop")
    loaded = [replace(r, force=r.force + preload) for r in records]
    assert material_excess(loaded) == pytest.approx(material_excess(records), rel=1e-6)


def test_what_matters_grows_with_the_force() -> None:
    records = records_with("end_stop")
    twice = [replace(r, force=2.0 * r.force) for r in records]
    assert material_excess(twice) == pytest.approx(4.0 * material_excess(records), rel=1e-6)
