"""Frequency-selective damping: firm for slow motion, soft for fast, bolted or behind a bush."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.motions import T, motion

Floats = NDArray[np.float64]

C, TAU = 2000.0, 0.02
SELECTIVE = element("frequency_selective_damping", {"c": C, "tau": TAU})


@pytest.mark.parametrize("frequency", [0.5, 5.0, 40.0])
def test_under_a_sine_it_is_a_first_order_low_pass_of_the_velocity(frequency: float) -> None:
    turn, m = 2 * np.pi * frequency, motion(frequency, 0.01)
    force = simulate(Model(name="m", elements=(SELECTIVE,)), m).force

    def steady(amplitude: float, w: float) -> Floats:
        return np.real(C * amplitude * w / (1 + 1j * w * TAU) * np.exp(1j * w * T))

    expected = steady(0.01, turn) + steady(0.002, 3.1 * turn)
    late = slice(round(15 * TAU * 1000), None)
    error = np.max(np.abs(force - expected)[late])
    assert error < (3.1 * turn * 1e-3) ** 2 / 10 * np.max(np.abs(expected))  # the velocity is linear between samples


@pytest.mark.parametrize(("k", "c"), [(4e4, 100.0), (1e6, 0.0)])
def test_behind_a_bush_it_meets_another_integrator(k: float, c: float) -> None:
    beside, turn = 300.0, 4 * np.pi

    def bush_rate(t: float, e: float, y: float) -> float:
        v = 0.02 * turn * np.cos(turn * t) + 0.0124 * turn * np.cos(3.1 * turn * t)
        return (C * y + beside * v - k * e) / (beside + c)

    def rate(t: float, state: Floats) -> list[float]:
        e, y = state
        r = bush_rate(t, e, y)
        v = 0.02 * turn * np.cos(turn * t) + 0.0124 * turn * np.cos(3.1 * turn * t)
        return [r, (v - r - y) / TAU]

    start = [0.0, 0.0324 * turn]
    found = solve_ivp(rate, (0.0, 0.6), start, method="LSODA", rtol=1e-9, atol=1e-12, t_eval=T[:601])
    expected = np.array([k * e + c * bush_rate(t, e, y) for t, (e, y) in zip(found.t, found.y.T, strict=True)])
    bush = element("series_compliance", {"k": k, "c": c})
    model = Model(name="m", elements=(SELECTIVE, element("viscous_damping", {"c": beside}), bush))
    force = simulate(model, motion()).force[:601]
    assert np.linalg.norm((force - expected)[200:]) < 1e-3 * np.linalg.norm(expected[200:])
