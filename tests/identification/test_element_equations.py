"""The force of an element without memory is the equation of its row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.physical.elements import CATALOGUE, Family
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import TYPICAL
from tests.identification.motions import motion

Floats = NDArray[np.float64]
Equation = Callable[[Floats, Floats, Floats, Mapping[str, float]], Any]


def beyond(value: Floats, limit: float) -> Floats:
    return np.maximum(np.abs(value) - limit, 0.0)


def on_side(w: Floats, c: tuple[float, float], knee: tuple[float, float], share: float) -> Floats:
    slope, bend = np.where(w > 0, *c), np.where(w > 0, *knee)
    return slope * w * (share + (1 - share) / np.sqrt(1 + (w / bend) ** 2))


def current_slope(u: Floats, q: Mapping[str, float]) -> Floats:
    return np.interp(u, [q["u_soft"], q["u_firm"]], [q["c_soft"], q["c_firm"]])


EQUATIONS: dict[str, Equation] = {
    "viscous_damping": lambda z, w, u, q: (q["c"] + q["c_control"] * u) * w,
    "arctan_damping": lambda z, w, u, q: q["F1"] * 2 / np.pi * np.arctan(q["S"] * w) + q["d"] * w + q["F2"],
    "piecewise_linear_damping": lambda z, w, u, q: np.where(
        np.abs(q["c1"] * w) < q["f_r"], q["c1"] * w, np.sign(w) * (1 - q["c2"] / q["c1"]) * q["f_r"] + q["c2"] * w
    ),
    "valve_damping": lambda z, w, u, q: current_slope(u, q) * w / np.sqrt(1 + (w / q["w_knee"]) ** 2),
    "quadratic_damping": lambda z, w, u, q: q["q"] * w * np.abs(w),
    "relief_valve": lambda z, w, u, q: -q["c_drop"] * np.sign(w) * beyond(w, q["w_knee"]),
    "damping_asymmetry": lambda z, w, u, q: q["c_a"] * np.abs(w),
    "rebound_compression_damping": lambda z, w, u, q: on_side(
        w, (q["c_r"], q["c_c"]), (q["w_r"], q["w_c"]), q["share"]
    ),
    "hydraulic_bump_stop": lambda z, w, u, q: q["q"] * beyond(z, q["z_max"]) * w * np.abs(w),
    "tanh_hysteresis": lambda z, w, u, q: (
        (q["alpha"] + q["alpha_control"] * u) * np.tanh(q["beta"] * w + q["delta"] * np.tanh(z / q["z_r"]))
    ),
    "linear_stiffness": lambda z, w, u, q: q["k"] * z,
    "cubic_stiffness": lambda z, w, u, q: q["k3"] * z**3,
    "gas_spring": lambda z, w, u, q: -q["f0"] * (1 + z / q["length"]) ** -q["n"],
    "end_stop": lambda z, w, u, q: q["k"] * np.sign(z) * beyond(z, q["z_max"]),
}


def test_no_element_of_damping_or_spring_is_left_out() -> None:
    assert set(EQUATIONS) == {n for n, s in CATALOGUE.items() if s.family in (Family.DAMPING, Family.SPRING)}


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_force_of_an_element_is_the_equation_of_its_row(name: str) -> None:
    inputs = motion(3.0, 0.02)
    values = dict(TYPICAL[name])
    force = simulate(Model(name="m", elements=(element(name, values),)), inputs).force
    expected = EQUATIONS[name](inputs.x, inputs.v, inputs.i, values)
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))
    assert np.ptp(force) > 0.0
