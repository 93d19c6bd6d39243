"""A gas whose heat passes its wall: between adiabatic, where it is quick, and isothermal, where it is slow."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.discrepancy import explain
from identification.fitting.leastsquares import fit_records
from identification.models.stepping import Moment
from identification.physical.accuracy import numerical_error
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from identification.physical.stepping import PhysicalStepper
from identification.record import record_from_run
from tests.identification.motions import T, motion
from tests.identification.ordinary import motion as two_sines
from tests.identification.ordinary import recorded

Floats = NDArray[np.float64]

F0, LENGTH, N = 800.0, 0.1, 1.38


def gas(heat: float, rested: float = 0.0) -> Element:
    return element("gas_spring", {"f0": F0, "length": LENGTH, "n": N, "heat": heat, "rested": rested})


def force_of(*elements: Element) -> Floats:
    return simulate(Model(name="m", elements=elements), motion()).force


def by_energy(t: Floats, x: Floats, heat: float, length: float = LENGTH) -> Floats:
    """The force of an ideal gas: m c_v dT/dt = −p dV/dt − h A (T − T₀), from the temperature around it."""
    share = np.interp  # of the volume at the middle

    def rate(now: float, theta: Floats) -> Floats:
        s = 1.0 + share(now, t, x) / length
        change = share(now, t, np.gradient(x, t)) / length
        return np.asarray(-(N - 1.0) * theta * change / s - heat * (theta - 1.0))

    theta = solve_ivp(rate, (t[0], t[-1]), [1.0], t_eval=t, rtol=1e-7, atol=1e-9, max_step=0.02).y[0]
    return np.asarray(-F0 * theta / (1.0 + x / length))


@pytest.mark.parametrize(("heat", "exponent"), [(1e-9, N), (1e6, 1.0)])
def test_a_quick_gas_is_adiabatic_and_a_slow_one_isothermal(heat: float, exponent: float) -> None:
    x = motion().x
    level = np.mean((1.0 + x / LENGTH) ** (N - 1.0)) if heat < 1.0 else 1.0
    expected = -F0 * level * (1.0 + x / LENGTH) ** -exponent
    np.testing.assert_allclose(force_of(gas(heat))[1:], expected[1:], rtol=1e-5)


@pytest.mark.parametrize("heat", [0.3, 3.0, 30.0])
def test_between_both_the_force_is_that_of_the_energy_of_the_gas(heat: float) -> None:
    expected = by_energy(T, motion().x, heat)
    np.testing.assert_allclose(force_of(gas(heat, rested=1.0)), expected, rtol=1e-4)


def test_its_memory_is_no_part_of_what_a_fade_scales() -> None:
    fade = element("temperature_fade", {"kappa": 0.01, "T_ref": 25.0})
    film = element("viscous_damping", {"c": 100.0})
    np.testing.assert_allclose(force_of(gas(2.0), film, fade) - force_of(film, fade), force_of(gas(2.0)), rtol=1e-12)


def test_without_a_mount_it_is_as_stiff_as_behind_a_stiff_one() -> None:
    behind = element("series_compliance", {"k": 1e9, "c": 1e5})
    film = element("viscous_damping", {"c": 100.0})
    np.testing.assert_allclose(force_of(behind, gas(2.0), film)[5:], force_of(gas(2.0), film)[5:], rtol=1e-3)
    assert numerical_error(Model(name="m", elements=(gas(2.0), film)), motion()).relative < 1e-4


def test_sample_by_sample_it_begins_at_the_temperature_around_it() -> None:
    stepper = PhysicalStepper(Model(name="m", elements=(gas(2.0),)), 0.01)
    start = stepper.start(Moment(x=0.02, v=0.0, a=0.0, i=0.0, temperature=25.0))
    assert start == pytest.approx(-F0 / (1.0 + 0.02 / LENGTH))


def test_a_fit_finds_how_fast_the_heat_passes() -> None:
    t, x, v = two_sines(3, 0.02, seconds=30.0)
    run = recorded("gas", 3, x, by_energy(t, x, 0.25, 0.12) + 200.0 * v, noise=1.0)
    free = element("gas_spring", {"f0": 700.0, "length": 0.1, "n": 1.3, "heat": 1.0, "rested": 0.5})
    film = element("viscous_damping", {"c": 150.0, "c_control": 0.0}, fixed=("c_control",))
    fit = fit_records(Model(name="m", elements=(film, free)), [record_from_run(run)])
    found = fit.model.element("gas_spring")
    for name, truth, share in (("f0", F0, 0.02), ("length", 0.12, 0.05), ("n", N, 0.05), ("heat", 0.25, 0.05)):
        assert found.value(name) == pytest.approx(truth, rel=share), name
    assert found.value("rested") == pytest.approx(1.0, abs=0.2)


@pytest.mark.slow
def test_an_air_spring_that_takes_up_heat_is_a_gas_spring_and_no_drift_of_the_load_cell() -> None:
    """Its force drifts for the first seconds, and differs between tests that are slow and quick."""
    sizes = (0.012, 0.03, 0.02, 0.036, 0.026)
    runs = []
    for k, size in enumerate(sizes):
        t, x, v = two_sines(k, size, seconds=20.0)
        runs.append(recorded("air", k, x, by_energy(t, x, 0.15, 0.1) + 150.0 * v, noise=2.0))
    base = Model(
        name="base",
        elements=(
            element("viscous_damping", {"c": 150.0, "c_control": 0.0}, fixed=("c_control",)),
            element("linear_stiffness", {"k": 9000.0}),
            element("force_offset", {"F0": -700.0}),
        ),
    )
    found = explain(base, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["gas_spring"]
    assert found.effects[0].confidence > 0.7
    heat = found.model.element("gas_spring").value("heat")
    assert heat == pytest.approx(0.15, rel=0.3)
