"""A coil that rises and falls with times of its own: exact between samples, also where the current turns its sign."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.physical.elements import CATALOGUE
from identification.physical.elements.equations.control import effective_current
from identification.physical.elements.equations.current_steps import CurrentPath
from identification.physical.model import Element, element
from tests.identification.gradients import TYPICAL

Floats = NDArray[np.float64]

DT = 1e-3
TIMES = st.floats(2e-4, 0.2)
SLOW = st.floats(3e-3, 0.2)  # for an integrator that passes over the moments in which a faster one acts


def current(seed: int, offset: float) -> Floats:
    """Seven random levels, ten samples apart and joined by lines that are no steps."""
    levels = offset + np.random.default_rng(seed).standard_normal(7)
    return np.interp(np.arange(61), 10.0 * np.arange(7), levels)


def coil(rise: float, fall: float) -> Element:
    return element("coil_lag", {"tau_rise": rise, "tau_fall": fall})


def answer(elements: list[Element], i: Floats) -> tuple[Floats, Floats]:
    return effective_current(elements, i, DT, 0)


@settings(max_examples=8)
@given(rise=SLOW, fall=SLOW, seed=st.integers(0, 1000), offset=st.sampled_from([0.0, 3.0]))
def test_it_meets_another_integrator_whatever_the_sign_of_the_current(
    rise: float, fall: float, seed: int, offset: float
) -> None:
    i = current(seed, offset)
    t = DT * np.arange(i.size)

    def rate(at: float, u: Floats) -> Floats:
        now = np.interp(at, t, i)
        return np.asarray((now - u) / (rise if (now - u[0]) * now > 0 else fall))

    found = solve_ivp(rate, (0.0, t[-1]), [i[0]], method="RK45", t_eval=t, rtol=1e-7, atol=1e-9, max_step=DT / 8)
    assert np.max(np.abs(answer([coil(rise, fall)], i)[0] - found.y[0])) < 2e-4 * np.max(np.abs(i))


@given(tau=TIMES, seed=st.integers(0, 1000))
def test_with_equal_times_it_is_a_lag_with_one(tau: float, seed: int) -> None:
    i = current(seed, 0.5)
    one, by_one = answer([element("control_lag", {"tau": tau})], i)
    two, by_two = answer([coil(tau, tau)], i)
    np.testing.assert_allclose(two, one, rtol=0, atol=1e-9)
    np.testing.assert_allclose(by_two.sum(axis=0), by_one[0], rtol=0, atol=1e-6 * np.max(np.abs(by_one)) + 1e-9)


@given(rise=TIMES, fall=TIMES, seed=st.integers(0, 1000))
def test_a_lag_of_the_control_with_a_fall_is_a_coil(rise: float, fall: float, seed: int) -> None:
    i = current(seed, 0.5)
    lag, by_lag = answer([element("control_lag", {"tau": rise, "fall": max(fall, 1e-6)})], i)
    two, by_two = answer([coil(rise, max(fall, 1e-6))], i)
    assert np.array_equal(lag, two)
    assert np.array_equal(by_lag, by_two)


def test_it_rises_with_one_time_and_falls_with_the_other_on_either_side_of_zero() -> None:
    for side in (1.0, -1.0):
        i = side * np.concatenate([np.full(50, 0.2), np.full(100, 1.0), np.full(100, 0.2)])
        u = side * answer([coil(0.01, 0.04)], i)[0]
        assert u[49 + 11] == pytest.approx(1.0 - 0.8 * np.exp(-1.0), abs=0.01)
        assert u[149 + 41] == pytest.approx(0.2 + 0.8 * np.exp(-1.0), abs=0.01)


@pytest.mark.parametrize("offset", [0.0, 2.5])
def test_its_sensitivities_are_those_of_the_current_through_what_stands_before_it(offset: float) -> None:
    i = current(3, offset)

    def after(values: Floats) -> Floats:
        i_s, rise, fall = values
        return answer([element("control_saturation", {"i_s": i_s}), coil(rise, fall)], i)[0]

    values = np.array([1.5, 0.004, 0.009])
    _, by = answer([element("control_saturation", {"i_s": 1.5}), coil(0.004, 0.009)], i)
    for k, row in enumerate(by):
        step = np.zeros(3)
        step[k] = 1e-6 * values[k]
        expected = (after(values + step) - after(values - step)) / (2 * step[k])
        np.testing.assert_allclose(row, expected, rtol=0, atol=2e-5 * np.max(np.abs(expected)))


@given(rise=TIMES, fall=TIMES, seed=st.integers(0, 1000))
def test_from_sample_to_sample_it_is_the_same(rise: float, fall: float, seed: int) -> None:
    i = current(seed, 0.5)
    path = CurrentPath([coil(rise, fall)], DT)
    steps = [path.start(float(i[0])), *(path.advance(float(now)) for now in i[1:])]
    np.testing.assert_allclose(steps, answer([coil(rise, fall)], i)[0], rtol=0, atol=1e-12)


def test_every_element_of_the_control_path_can_go_from_sample_to_sample() -> None:
    for name in (n for n, spec in CATALOGUE.items() if spec.path == "control"):
        path = CurrentPath([element(name, TYPICAL[name])], DT)
        assert path.start(0.7) == pytest.approx(answer([element(name, TYPICAL[name])], np.full(3, 0.7))[0][-1])
