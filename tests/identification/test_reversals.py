"""Memories of elements over a step in which the core turns round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.physical.elements.catalogue import code_of
from identification.physical.elements.equations.memory import PARTIALS, Leg, advance

PARAMETERS = {
    "presliding_friction": (2e5, 40.0),
    "lugre_friction": (2e5, 0.0, 40.0, 60.0, 0.01),
    "bouc_wen": (500.0, 1.0, 2.0, 5e4, 5e4, 0.0),
}


@pytest.mark.parametrize("name", sorted(PARAMETERS))
@given(exponent=st.floats(-300.0, 0.0), speed=st.floats(1e-6, 1.0), side=st.sampled_from([-1.0, 1.0]))
def test_a_core_that_turns_round_at_once_has_gone_the_way_back_only(
    name: str, exponent: float, speed: float, side: float
) -> None:
    h, code, p = 1e-3, code_of(name), np.array(PARAMETERS[name])
    before = speed * 10.0**exponent

    def after(w_old: float) -> float:
        way = 0.5 * h * (side * speed + w_old)
        leg = Leg(way, w_old, side * speed, h, way)
        partials = np.zeros(PARTIALS)
        new = float(advance(code, p, 0, 1e-5, leg, True, partials, np.zeros(PARTIALS)))
        assert np.all(np.isfinite(partials))
        return new

    turned, straight = after(-side * before), after(0.0)
    assert turned == pytest.approx(straight, rel=1e-6, abs=2.0 * h * max(before, 1e-12) * max(1.0, p[0]))
