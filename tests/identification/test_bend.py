"""A valve whose slope falls beyond a knee: the knee is round, the fall follows the current, and it is no hysteresis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.discrepancy import explain
from identification.discrepancy.choice import is_mistaken
from identification.discrepancy.trials import trial_of
from identification.fitting.leastsquares import fit_records
from identification.physical.elements.equations.damping import Relief, relief
from identification.physical.elements.equations.point import Point
from identification.physical.model import Model, element
from identification.record import compact, record_from_run
from identification.scales import scales_of
from rigctl.runfile import Run
from tests.identification.ordinary import Floats, motion, recorded

LINEAR = Model(name="linear", elements=(element("viscous_damping", {"c": 600.0, "c_control": 1200.0}),))
BENDS = {"relief_valve", "valve_damping", "piecewise_linear_damping", "arctan_damping"}
speeds = st.floats(1e-3, 3.0)


def bent(v: Floats) -> Floats:
    """A curve whose slope falls to a quarter around 0.12 m/s, without a corner."""
    return np.asarray(0.25 * v + 0.75 * 0.12 * np.arcsinh(np.sinh(1.0) * v / 0.12))


def controlled(seed: int, amplitude: float, current: float) -> Run:
    """A run at one current, which stiffens the valve as a whole."""
    _, x, v = motion(seed, amplitude)
    force = (600.0 + 1200.0 * current) * bent(v)
    return recorded("valve", seed, x, force, more={"current": np.full(x.size, current)})


@pytest.mark.parametrize("first", [0, pytest.param(20, marks=pytest.mark.slow)])
def test_a_bend_that_follows_the_current_is_no_hysteresis(first: int) -> None:
    plan = [(0.02, 0.4), (0.03, 0.8), (0.012, 1.2), (0.035, 1.6), (0.025, 1.0), (0.03, 1.4)]
    runs = [controlled(first + k, *p) for k, p in enumerate(plan)]
    found = explain(LINEAR, runs[:4], runs[4:])
    named = {e.element for e in found.effects}
    assert named
    assert named <= BENDS
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.9


def at(w: float, u: float = 0.0) -> Point:
    return Point(0.0, w, 0.0, u, 25.0, 0.0, 0.0)


@given(w=speeds, knee=speeds, rounded=st.floats(0.0, 1.0), u=st.floats(-2.0, 2.0))
def test_a_round_knee_is_odd_meets_the_sharp_one_far_away_and_takes_nothing_at_rest(
    w: float, knee: float, rounded: float, u: float
) -> None:
    valve = Relief(200.0, knee, 50.0, rounded)
    f = relief(valve, at(w, u))[0].f
    assert relief(valve, at(-w, u))[0].f == -f
    assert relief(valve, at(0.0, u))[0].f == 0.0
    drop, far = 200.0 + 50.0 * u, 1e6
    asymptote = far - knee - 0.5 * (np.hypot(knee, rounded) - knee)
    assert relief(valve, at(far, u))[0].f == pytest.approx(-drop * asymptote, rel=1e-9)
    if rounded == 0.0:
        assert f == pytest.approx(-drop * max(0.0, w - knee), abs=1e-9)


def yielding(seed: int, amplitude: float, current: float) -> Run:
    """A run of a fluid whose yield force grows with the current, beside a dashpot that does not."""
    _, x, v = motion(seed, amplitude)
    force = 900.0 * v + (30.0 + 90.0 * current) * v / np.hypot(v, 0.02)
    return recorded("fluid", seed, x, force, more={"current": np.full(x.size, current)})


def test_a_yield_force_that_follows_the_current_is_no_bend_of_a_dashpot_that_does_not() -> None:
    dashpot = Model(name="dashpot", elements=(element("viscous_damping", {"c": 850.0, "c_control": 0.0}),))
    plan = [(0.02, 0.4), (0.03, 0.8), (0.012, 1.2), (0.035, 1.6), (0.025, 1.0), (0.03, 1.4)]
    runs = [yielding(40 + k, *p) for k, p in enumerate(plan)]
    found = explain(dashpot, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["tanh_hysteresis"]


@pytest.mark.parametrize(("drop", "gain", "refused"), [(500.0, 500.0, False), (500.0, 5e4, True), (5e4, 0.0, True)])
def test_a_bend_that_takes_several_times_the_slope_of_the_force_is_a_yield_force(
    drop: float, gain: float, refused: bool
) -> None:
    records = [compact(record_from_run(controlled(k, 0.03, 1.0))) for k in range(2)]
    base = fit_records(LINEAR, records, max_iterations=0)
    valve = element("relief_valve", {"c_drop": drop, "w_knee": 0.1, "c_drop_control": gain})
    fit = fit_records(LINEAR.with_element(valve), records, max_iterations=0)
    assert is_mistaken(trial_of(fit, "relief_valve", base, records, 0.0)) == refused


@pytest.mark.parametrize(("knee", "refused"), [(0.05, False), (2e-4, True)])
def test_a_curve_that_bends_far_below_the_slow_speeds_is_a_friction(knee: float, refused: bool) -> None:
    records = [compact(record_from_run(controlled(k, 0.03, 1.0))) for k in range(2)]
    base = fit_records(LINEAR, records, max_iterations=0)
    curve = element("piecewise_linear_damping", {"c1": 40.0 / knee, "c2": 5.0, "f_r": 40.0})
    fit = fit_records(LINEAR.with_element(curve), records, max_iterations=0)
    assert is_mistaken(trial_of(fit, "piecewise_linear_damping", base, records, 0.0)) == refused


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction"])
@pytest.mark.parametrize(("times_slow", "refused"), [(0.5, False), (1.5, True)])
def test_a_friction_that_builds_up_over_more_than_the_slow_speeds_is_a_curve(
    name: str, times_slow: float, refused: bool
) -> None:
    records = [compact(record_from_run(controlled(k, 0.03, 1.0))) for k in range(2)]
    slow = times_slow * scales_of(records, 0.0).speeds[0]
    own = {"f_c": 50.0, "w_r": slow} | ({"f_s": 90.0, "w_s": 0.1} if name == "stribeck_friction" else {})
    base = fit_records(LINEAR, records, max_iterations=0)
    fit = fit_records(LINEAR.with_element(element(name, own)), records, max_iterations=0)
    assert is_mistaken(trial_of(fit, name, base, records, 0.0)) == refused


def test_a_curve_that_gives_half_of_its_force_to_one_side_is_an_asymmetry_and_a_bend_and_no_friction() -> None:
    dashpot = Model(name="dashpot", elements=(element("viscous_damping", {"c": 2000.0}),))
    runs = []
    for k, amplitude in enumerate((0.02, 0.03, 0.012, 0.035, 0.025)):
        _, x, v = motion(60 + k, amplitude, seconds=6.0)
        force = np.where(v > 0.0, 2500.0, 1250.0) * 0.1 * np.abs(v / 0.1) ** 0.9 * np.sign(v)
        runs.append(recorded("valve", 60 + k, x, force, noise=1.0))
    named = {e.element for e in explain(dashpot, runs[:4], runs[4:]).effects}
    assert "damping_asymmetry" in named
    assert named - {"damping_asymmetry"} <= BENDS
