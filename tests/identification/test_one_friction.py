"""Rubber whose friction builds up over several travels: one friction of another form, and not two."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy import explain
from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Compared, Search
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import compact, record_from_run
from tests.identification.ordinary import motion, recorded

Floats = NDArray[np.float64]
NAMING = sys.modules["identification.discrepancy.naming"]

BASE = Model(
    name="a spring beside a dashpot",
    elements=(
        element("linear_stiffness", {"k": 9e4}),
        element("viscous_damping", {"c": 300.0, "c_control": 0.0}, fixed=("c_control",)),
    ),
)


def built_up(x: Floats, parts: Sequence[tuple[float, float]]) -> Floats:
    """Dry friction behind springs, side by side: of each the stiffness, N/m, and the travel at which it slides, m."""
    force = np.zeros(x.size)
    for k, travel in parts:
        s = 0.0
        for n in range(1, x.size):
            s = min(max(s + x[n] - x[n - 1], -travel), travel)
            force[n] += k * s
    return force


@pytest.mark.slow
def test_within_the_form_of_a_friction_no_other_one_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    records = []
    for k, amplitude in enumerate((0.002, 0.006, 0.004)):
        _, x, v = motion(k, amplitude, seconds=6.0)
        force = 9e4 * x + 300.0 * v + built_up(x, ((3e5, 1e-4), (6e4, 8e-4)))
        records.append(compact(record_from_run(recorded("bush", k, x, force, noise=1.0))))
    base = fit_records(BASE, records)
    slides = element("presliding_friction", {"sigma": 3e5, "f_c": 60.0})
    fit = fit_records(base.model.with_element(slides), records)
    state = Search(
        fit=fit, names=(slides.id,), excess=excess_of(fit), given=BASE, base_excess=excess_of(base),
        compared={slides.id: Compared(without=base, start=base, beside=(), rivals=())},
    )  # fmt: skip
    monkeypatch.setattr(NAMING, "gap_remains", lambda *_: False)
    assert NAMING.search_from(state, records, str).names == (slides.id,)


@pytest.mark.slow
def test_a_friction_whose_parts_give_way_one_after_the_other_is_not_behind_a_bush() -> None:
    """What the friction of one travel leaves, a bush of 16 MN/m closes: it lets the friction build up so."""
    runs = []
    for k, amplitude in enumerate((0.012, 0.010, 0.007, 0.019, 0.016)):
        _, x, v = motion(k, amplitude, seconds=6.0)
        parts = [(10.0 / travel, travel) for travel in 3e-6 * np.geomspace(0.25, 4.0, 6)]
        runs.append(recorded("guide", k, x, 900.0 * v + built_up(x, parts), noise=0.5))
    elements = (element("viscous_damping", {"c": 800.0}), element("coulomb_friction", {"f_c": 50.0}))
    found = explain(Model(name="an ideal friction", elements=elements), runs[:4], runs[4:])
    assert "series_compliance" not in [e.element for e in found.effects]
