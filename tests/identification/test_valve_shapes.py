"""Curves of valves and magnets: the flows of a shim stack add up, a force that falls with speed stays followed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.physical.elements.equations.point import Point
from identification.physical.elements.equations.shims import Shims, shim_stack
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.motions import T, motion

Floats = NDArray[np.float64]
positive = st.floats(0.1, 1e4)


def at(w: float) -> Point:
    return Point(0.0, w, 0.0, 0.0, 25.0, 0.0, 0.0)


@given(q=st.floats(1.0, 1e6), opens=positive, shim=positive, blows=positive, blow=positive, w=st.floats(0.0, 5.0))
def test_the_flows_of_a_shim_stack_add_up_to_the_speed_in_either_order_of_opening(
    q: float, opens: float, shim: float, blows: float, blow: float, w: float
) -> None:
    stack = Shims(q, opens, shim, blows, blow)
    f = shim_stack(stack, at(w))[0].f
    flow = np.sqrt(f / q) + max(0.0, f - opens) / shim + max(0.0, f - blows) / blow
    assert flow == pytest.approx(w, rel=1e-9, abs=1e-12)
    assert shim_stack(stack, at(-w))[0].f == -f


def test_at_rest_a_shim_stack_has_no_slope_even_where_it_opens_at_once() -> None:
    for opens in (0.0, 60.0):
        force, partials = shim_stack(Shims(1e4, opens, 1e3, 200.0, 1e3), at(0.0))
        assert force.by_w == 0.0
        assert np.all(np.isfinite(partials))


def behind_bush(f_peak: float, w_peak: float, k: float, c: float) -> Model:
    magnet = element("eddy_current_damping", {"f_peak": f_peak, "w_peak": w_peak})
    return Model(name="magnet", elements=(magnet, element("series_compliance", {"k": k, "c": c})))


def test_behind_a_bush_that_damps_more_than_it_falls_an_eddy_current_damper_meets_another_integrator() -> None:
    f_peak, w_peak, k, c = 150.0, 0.15, 2e4, 300.0
    assert c > f_peak / (4 * w_peak)
    turn = 4 * np.pi

    def bush_rate(t: float, e: float) -> float:
        v = 0.02 * turn * np.cos(turn * t) + 0.0124 * turn * np.cos(3.1 * turn * t)
        low, high = -5.0, 5.0
        for _ in range(60):
            r = 0.5 * (low + high)
            over = 2 * f_peak * w_peak * (v - r) / (w_peak**2 + (v - r) ** 2) > k * e + c * r
            low, high = (r, high) if over else (low, r)
        return 0.5 * (low + high)

    found = solve_ivp(
        lambda t, e: [bush_rate(t, e[0])], (0.0, 0.5), [0.0], method="LSODA", rtol=1e-8, atol=1e-11, t_eval=T[:501]
    )
    expected = np.array([k * e + c * bush_rate(t, e) for t, e in zip(found.t, found.y[0], strict=True)])
    force = simulate(behind_bush(f_peak, w_peak, k, c), motion()).force[:501]
    assert np.linalg.norm((force - expected)[60:]) < 1e-4 * np.linalg.norm(expected[60:])


@pytest.mark.parametrize("k", [2e4, 1e6, 3e7])
def test_behind_a_spring_alone_it_breaks_loose_and_never_exceeds_its_peak(k: float) -> None:
    answer = simulate(behind_bush(3000.0, 0.1, k, 0.0), motion(), gradient=True)
    assert answer.failures == 0
    assert np.max(np.abs(answer.force)) <= 3000.0 * (1 + 1e-9)
    assert answer.gradient is not None
    assert np.all(np.isfinite(answer.gradient))
