"""The solver against what defines it: closed forms, a tight implicit reference, and its own gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from identification.errors import SimulationError
from identification.models.motion import Motion
from identification.physical.accuracy import numerical_error
from identification.physical.elements import CATALOGUE
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import gradient_error
from tests.identification.motions import DT, N, T, motion

BASE = (
    element("valve_damping", {"c_soft": 800, "c_firm": 4000, "u_soft": 0.2, "u_firm": 1.7, "w_knee": 0.4}),
    element("tanh_hysteresis", {"alpha": 80, "alpha_control": 10, "beta": 30, "delta": 0.0}),
)
MOUNT = element("series_compliance", {"k": 1.2e6, "c": 300})
EXTRA = (
    element("viscous_damping", {"c": 100, "c_control": 50}),
    element("arctan_damping", {"F1": 300, "S": 30, "d": 100, "F2": 3}),
    element("quadratic_damping", {"q": 300}),
    element("damping_asymmetry", {"c_a": 100}),
    element("tanh_hysteresis", {"alpha": 90, "alpha_control": 20, "beta": 20, "delta": 0.6, "z_r": 0.001}),
    element("coulomb_friction", {"f_c": 60}),
    element("coulomb_friction", {"f_c": 60, "w_r": 0.02}),
    element("stribeck_friction", {"f_c": 50, "f_s": 90, "w_s": 0.05}),
    element("linear_stiffness", {"k": 4000}),
    element("cubic_stiffness", {"k3": 1e6}),
    element("gas_spring", {"f0": 200, "length": 0.12, "n": 1.3}),
    element("position_dependent_damping", {"p": 200}),
    element("temperature_fade", {"kappa": 0.01}),
    element("control_lag", {"tau": 0.012}),
    element("control_saturation", {"i_s": 1.0}),
    element("force_offset", {"F0": 7}),
    element("moving_mass", {"m": 2}),
    element("force_drift", {"rate": 3}),
)


@pytest.mark.parametrize("mounted", [False, True], ids=["rigid", "mounted"])
@pytest.mark.parametrize("extra", EXTRA, ids=lambda e: e.name)
def test_the_gradient_is_that_of_the_force(extra: Element, mounted: bool) -> None:
    elements = (*BASE, extra, MOUNT) if mounted else (*BASE, extra)
    assert gradient_error(Model(name="m", elements=elements), motion()) < 1e-5


@pytest.mark.parametrize("length", [1e-7, 1e-5, 1e-3, 1e-1])
def test_a_lag_after_reversal_has_a_finite_gradient_from_the_first_sample(length: float) -> None:
    model = Model(name="m", elements=(*BASE, element("reversal_force_lag", {"length": length})))
    gradient = simulate(model, motion(), gradient=True).gradient
    assert gradient is not None
    assert np.all(np.isfinite(gradient))


def test_a_stiff_maxwell_element_meets_a_tight_implicit_reference() -> None:
    f1, s, d, k = 8000.0, 60.0, 9000.0, 6.15e6
    inputs = motion(0.5, 0.01)
    turn = 2 * np.pi * 0.5

    def exact(t: float) -> float:
        return 0.01 * np.sin(turn * t) + 0.002 * np.sin(3.1 * turn * t)

    def rate(t: float, z: np.ndarray) -> list[float]:
        force = k * (exact(t) - z[0])
        low, high = -2.0, 2.0
        for _ in range(80):
            w = 0.5 * (low + high)
            low, high = (w, high) if f1 * 2 / np.pi * np.arctan(s * w) + d * w < force else (low, w)
        return [0.5 * (low + high)]

    reference = solve_ivp(rate, (0.0, 0.4), [0.0], method="Radau", rtol=1e-9, atol=1e-13, t_eval=T[:400])
    expected = k * (np.array([exact(t) for t in T[:400]]) - reference.y[0])
    model = Model(
        name="maxwell",
        elements=(
            element("arctan_damping", {"F1": f1, "S": s, "d": d}),
            element("series_compliance", {"k": k, "c": 0.0}),
        ),
    )
    force = simulate(model, inputs).force[:400]
    late = slice(60, 400)
    assert np.linalg.norm(force[late] - expected[late]) / np.linalg.norm(expected[late]) < 1e-7


def test_halving_the_step_of_a_mounted_model_quarters_its_error() -> None:
    model = Model(name="m", elements=(*BASE, MOUNT))
    finest = simulate(model, motion(8.0), substeps=64).force[200:]
    errors = [np.linalg.norm(simulate(model, motion(8.0), substeps=n).force[200:] - finest) for n in (2, 4, 8)]
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


SMOOTH = (
    element("arctan_damping", {"F1": 300, "S": 20, "d": 500}),
    element("gas_spring", {"f0": 200, "length": 0.12, "n": 1.3}),
)
RELAXING = element("relaxing_compliance", {"k1": 3e5, "k2": 2e5, "c2": 2e3})


@pytest.mark.parametrize("mount", [MOUNT, RELAXING], ids=lambda e: e.name)
def test_halving_the_step_of_a_smooth_mounted_model_divides_its_error_by_two_to_the_fifth(mount: Element) -> None:
    model, inputs = Model(name="m", elements=(*SMOOTH, mount)), motion(4.0)
    finest = simulate(model, inputs, substeps=32).force[200:]
    errors = [float(np.linalg.norm(simulate(model, inputs, substeps=n).force[200:] - finest)) for n in (1, 2)]
    assert errors[0] / errors[1] > 25.0
    assert errors[0] < 1e-6 * np.linalg.norm(finest)


def test_however_stiff_the_mount_is_one_step_per_sample_neither_rings_nor_diverges() -> None:
    inputs = motion(8.0)
    bolted = simulate(Model(name="m", elements=SMOOTH), inputs).force
    for k in (1e9, 1e12, 1e15):
        mount = element("series_compliance", {"k": k, "c": 0.0})
        force = simulate(Model(name="m", elements=(*SMOOTH, mount)), inputs).force
        assert force[5:] == pytest.approx(bolted[5:], rel=1e-6, abs=1e12 / k)


def test_a_force_that_jumps_within_a_step_is_still_solved() -> None:
    jump = element("tanh_hysteresis", {"alpha": 200, "beta": 30, "delta": 2.0})
    model, inputs = Model(name="m", elements=(jump, MOUNT)), motion(3.0)
    response, exact = simulate(model, inputs), simulate(model, inputs, substeps=50).force
    assert response.failures == 0
    assert np.linalg.norm(response.force - exact) < 0.02 * np.linalg.norm(exact)


def test_where_newton_would_go_to_and_fro_over_a_jump_the_bracket_closes_on_it() -> None:
    """A force that jumps with the direction, a hysteresis that grows as it is loaded, and a spring without a damper."""
    elements = (
        element("series_compliance", {"k": 2.6e7, "c": 0.0}),
        element("valve_damping", {"c_soft": 8000, "c_firm": 23000, "u_soft": 0.3, "u_firm": 1.6, "w_knee": 0.046}),
        element("tanh_hysteresis", {"alpha": 450, "beta": 120, "delta": 0.4}),
        element("bouc_wen", {"alpha": 10500, "A": 1.0, "n": 1.0, "beta": -108, "gamma": 46}),
    )
    model, inputs = Model(name="m", elements=elements), motion(0.7, 0.001)
    response, value = simulate(model, inputs, gradient=True), simulate(model, inputs)
    assert response.failures == value.failures == 0
    assert value.force == pytest.approx(response.force, rel=1e-9)
    assert np.linalg.norm(value.force - simulate(model, inputs, substeps=20).force) < 0.01 * np.linalg.norm(value.force)


@pytest.mark.parametrize("elements", [(*BASE, MOUNT), (*BASE, EXTRA[-2])], ids=["mounted", "rigid"])
def test_the_estimate_of_the_numerical_error_is_the_error(elements: tuple[Element, ...]) -> None:
    model, inputs = Model(name="m", elements=elements), motion(4.0)
    exact = simulate(model, inputs, substeps=64).force
    true = simulate(model, inputs).force - exact
    estimate = numerical_error(model, inputs)
    assert np.linalg.norm(estimate.force[100:] - true[100:]) <= 0.05 * np.linalg.norm(true[100:]) + 1e-9
    assert estimate.relative < 1e-2


def test_a_core_in_dry_friction_sticks_until_the_spring_pulls_harder() -> None:
    model = Model(
        name="jenkins",
        elements=(element("coulomb_friction", {"f_c": 500}), element("series_compliance", {"k": 1e6, "c": 0.0})),
    )
    inputs = motion(1.0, 0.001)
    force = simulate(model, inputs).force
    assert np.max(np.abs(force)) <= 500.0 * (1 + 1e-9)
    first = np.flatnonzero(np.abs(force) > 499.9)[0]
    assert force[1:first] == pytest.approx(1e6 * inputs.x[1:first], rel=1e-5)


@given(st.floats(-0.01, 0.01))
@settings(max_examples=20, deadline=None)
def test_a_delayed_force_is_the_force_of_the_past_and_an_early_one_that_of_the_future(tau: float) -> None:
    n = 1000
    turn = 2 * np.pi * 5 * np.arange(n) / n
    x = 0.01 * np.sin(turn)
    rate = 2 * np.pi * 5 / (n * DT)
    inputs = Motion(
        dt=DT, x=x, v=0.01 * rate * np.cos(turn), a=-0.01 * rate**2 * np.sin(turn), i=np.zeros(n),
        temperature=np.full(n, 25.0), t=np.arange(n) * DT, period=n,
    )  # fmt: skip
    model = Model(name="m", elements=(element("viscous_damping", {"c": 1000.0}), element("force_delay", {"tau": tau})))
    assert simulate(model, inputs).force == pytest.approx(1000 * 0.01 * rate * np.cos(turn - rate * tau), abs=1e-6)


def test_a_turn_without_a_lag_is_not_left_out_it_strengthens_what_is_below_it() -> None:
    inputs, rate, turn = small_sine(3), 4 * np.pi, 0.02
    late = {"tau": 0.0, "lag": 0.0, "turn": turn}
    model = Model(name="m", elements=(element("viscous_damping", {"c": 1000.0}), element("force_delay", late)))
    plain = Model(name="m", elements=model.elements[:1])
    expected = simulate(plain, inputs).force / (1.0 - (rate * turn) ** 2)
    np.testing.assert_allclose(simulate(model, inputs).force, expected, rtol=1e-3, atol=0.05)


@given(tau=st.floats(0.0, 0.01), lag=st.floats(0.0, 0.2), turn=st.floats(0.0, 1.0), periodic=st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_lagging_force_is_weaker_and_later_as_a_low_pass_of_one_or_two_poles_makes_it(
    tau: float, lag: float, turn: float, periodic: bool
) -> None:
    inputs = replace(small_sine(3), **({} if periodic else {"period": 0}))
    rate = 4 * np.pi
    late = {"tau": tau, "lag": lag, "turn": turn * lag}
    model = Model(name="m", elements=(element("viscous_damping", {"c": 1000.0}), element("force_delay", late)))
    force = simulate(model, inputs).force
    through = 1.0 / (1.0 + 1j * rate * lag - (turn * rate * lag) ** 2)
    expected = -1000 * 0.002 * rate * np.imag(through * np.exp(1j * rate * (inputs.t - tau)))
    settled = slice(0 if periodic else int((tau + 16 * lag) / inputs.dt) + 1, None)
    np.testing.assert_allclose(force[settled], expected[settled], atol=1e-3 * 1000 * 0.002 * rate)


def test_a_periodic_motion_answers_as_if_it_were_simulated_whole() -> None:
    inputs = replace(motion(2.0), period=500)
    one = inputs.x[:500]
    index = np.arange(N) % 500
    inputs = replace(inputs, x=one[index], v=inputs.v[index], a=inputs.a[index], i=inputs.i[index])
    model = Model(name="m", elements=BASE)
    whole, settled = simulate(model, inputs).force, simulate(model, replace(inputs, settle=1)).force
    assert settled == pytest.approx(whole, rel=1e-12)


def test_a_model_that_diverges_is_named_with_the_first_bad_sample() -> None:
    inputs = motion()
    bad = replace(inputs, x=np.where(T > 1.0, np.inf, inputs.x))
    model = Model(name="spring", elements=(element("linear_stiffness", {"k": 1e3}),))
    with pytest.raises(SimulationError, match="'spring' gives inf at sample 1001"):
        simulate(model, bad)


def test_every_element_of_the_catalogue_has_a_unit_for_every_parameter() -> None:
    assert all(p.unit for spec in CATALOGUE.values() for p in spec.parameters)


def small_sine(periods: int) -> Motion:
    period, turn = 500, 4 * np.pi
    t = np.arange(periods * period) * DT
    x, v = 0.002 * np.cos(turn * t), -0.002 * turn * np.sin(turn * t)
    still = np.zeros(t.size)
    return Motion(dt=DT, x=x, v=v, a=-(turn**2) * x, i=still, temperature=still, t=t, period=period)


@pytest.mark.parametrize("mount", [(), (element("series_compliance", {"k": 2e7, "c": 0.0}),)])
@pytest.mark.parametrize("dropped", [1, 3])
def test_the_periods_of_a_settled_run_are_those_of_a_long_one(dropped: int, mount: tuple[Element, ...]) -> None:
    """A hysteresis under a small sine still knows after the first period where it began."""
    wen = {"alpha": 2e6, "A": 1.0, "n": 1.0, "beta": 80.0, "gamma": 350.0}
    model = Model(name="m", elements=(element("bouc_wen", wen), element("viscous_damping", {"c": 3e4}), *mount))
    long = small_sine(12)
    period = long.period
    run = replace(long.head((dropped + 1) * period), settle=dropped)
    last, steady = (simulate(model, m).force[-period:] for m in (run, long))
    assert np.max(np.abs(last - steady)) < 1e-3 * np.max(np.abs(steady))
    assert np.max(np.abs(simulate(model, long).force[period : 2 * period] - steady)) > 0.01 * np.max(np.abs(steady))


@pytest.mark.parametrize(("ahead", "taken"), [(1.0, 1.0), (0.0, 0.25)])
def test_a_quick_look_keeps_the_period_after_those_that_it_waits_for(ahead: float, taken: float) -> None:
    wen = {"alpha": 2e6, "A": 1.0, "n": 1.0, "beta": 80.0, "gamma": 350.0}
    model = Model(name="m", elements=(element("bouc_wen", wen), element("viscous_damping", {"c": 3e4})))
    quick = replace(small_sine(1), settle=1, ahead=ahead)
    whole = quick.one_period(int(taken * quick.period))
    expected = simulate(model, replace(whole, settle=0)).force[-quick.period :]
    assert simulate(model, quick).force == pytest.approx(expected)


def test_a_curve_that_falls_beyond_the_speeds_of_the_motion_does_not_draw_the_core_there() -> None:
    """An asymmetry outgrows a saturated valve at some m/s: the equation of a step has a second root, far off."""
    valve = {"c_soft": 706.5, "c_firm": 2870, "u_soft": 0.3, "u_firm": 1.6, "w_knee": 0.05496}
    loop = {"alpha": 20.78, "alpha_control": 0.0, "beta": 149.3, "delta": 0.6714}
    core = (
        element("valve_damping", valve),
        element("tanh_hysteresis", loop),
        element("damping_asymmetry", {"c_a": 205}),
    )
    t, turn, speed = np.arange(120) * DT, 4 * np.pi / 2.05, 0.0637
    x, v = speed / turn * np.sin(turn * t), speed * np.cos(turn * t)
    still = np.full(t.size, 1.2)
    inputs = Motion(dt=DT, x=x, v=v, a=-(turn**2) * x, i=still, temperature=still, t=t)
    mounted, bolted = (
        simulate(Model(name="m", elements=elements), inputs).force
        for elements in ((element("series_compliance", {"k": 6.62e5, "c": 0.0}), *core), core)
    )
    assert np.max(np.abs(mounted)) < 1.05 * np.max(np.abs(bolted))
