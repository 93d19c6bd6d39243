"""Elements that naming does not add: a fit finds the values that made a run, within the deviations that it states."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.physical.model import element
from tests.identification.equations import EQUATIONS, FACTORS
from tests.identification.gradients import TYPICAL
from tests.identification.made_runs import PERIOD, PERIODS, RATE_HZ, inputs
from tests.identification.recovered import assert_found, fitted

Floats = NDArray[np.float64]


@pytest.mark.parametrize("name", ["eddy_current_damping", "shim_stack_damping", "progressive_stop"])
def test_a_fit_finds_the_values_of_an_element_of_one_moment(name: str) -> None:
    values = TYPICAL[name]
    model, free = fitted(lambda *inputs: EQUATIONS[name](*inputs, values), [element(name, values)])
    assert len(free) == len(values)
    assert_found(model, free, values)


def test_a_fit_finds_a_gas_spring_that_warms() -> None:
    values = TYPICAL["warm_gas_spring"]
    gas = element("warm_gas_spring", values)
    model, free = fitted(lambda *inputs: EQUATIONS["warm_gas_spring"](*inputs, values), [gas], warms_by=40.0)
    assert free == [f"warm_gas_spring.{p}" for p in ("f0", "length", "n")]
    assert_found(model, free, values)


@pytest.mark.parametrize("name", ["zone_damping", "cavitation"])
def test_a_fit_finds_a_factor_and_the_damping_that_it_multiplies(name: str) -> None:
    truth = {"c": 1000.0, **TYPICAL[name]}
    elements = [element("viscous_damping", {"c": 1000.0}), element(name, TYPICAL[name])]
    model, free = fitted(lambda x, v, i, t: 1000.0 * v * FACTORS[name](x, v, i, t, truth), elements)
    assert len(free) == len(truth)
    assert_found(model, free, truth)


def test_a_fit_finds_a_damper_that_follows_the_velocity_late() -> None:
    values = TYPICAL["frequency_selective_damping"]

    def law(x: Floats, v: Floats, i: Floats, _: Floats) -> Floats:
        lines = np.fft.rfft(v)
        omega = 2 * np.pi * np.fft.rfftfreq(v.size, 1 / RATE_HZ)
        return np.asarray(values["c"] * np.fft.irfft(lines / (1 + 1j * omega * values["tau"]), v.size))

    model, free = fitted(law, [element("frequency_selective_damping", values)])
    assert_found(model, free, values)


def test_a_fit_finds_both_times_of_a_coil() -> None:
    values = {"tau_rise": 0.012, "tau_fall": 0.03, "c": 500.0, "c_control": 900.0}
    t = np.arange(PERIOD * PERIODS) / RATE_HZ

    def rate(now: float, u: Floats) -> Floats:
        i = inputs(np.asarray(now))[2]
        return np.asarray((i - u) / np.where((i - u) * i > 0, values["tau_rise"], values["tau_fall"]))

    u = solve_ivp(rate, (0.0, t[-1]), [0.9], method="RK45", t_eval=t, rtol=1e-7, atol=1e-9, max_step=5e-3).y[0]
    u[:PERIOD] = u[PERIOD : 2 * PERIOD]  # as if it had always been so
    damping = element("viscous_damping", {"c": 500.0, "c_control": 900.0})
    coil = element("coil_lag", TYPICAL["coil_lag"])
    model, free = fitted(lambda x, v, i, _: (500.0 + 900.0 * u) * v, [coil, damping])
    assert len(free) == len(values)
    assert_found(model, free, values)
