"""The equation of every element of damping and springs, written a second time: the compiled one is held against it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Equation = Callable[[Floats, Floats, Floats, Floats, Mapping[str, float]], Any]  # z, w, u, T and parameters


def beyond(value: Floats, limit: float) -> Floats:
    return np.maximum(np.abs(value) - limit, 0.0)


def on_side(w: Floats, c: tuple[float, float], knee: tuple[float, float], share: float) -> Floats:
    slope, bend = np.where(w > 0, *c), np.where(w > 0, *knee)
    return slope * w * (share + (1 - share) / np.sqrt(1 + (w / bend) ** 2))


def shims(w: Floats, q: Mapping[str, float]) -> Floats:
    """The force at which the three flows add up to each speed, by bisection."""

    def flow(f: Floats) -> Any:
        through = np.maximum(f - q["f_open"], 0) / q["c_shim"] + np.maximum(f - q["f_blow"], 0) / q["c_blow"]
        return np.sqrt(f / q["q"]) + through

    low, high = np.zeros(w.size), q["q"] * w**2
    for _ in range(60):
        middle = 0.5 * (low + high)
        less = flow(middle) < np.abs(w)
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return np.asarray(np.sign(w) * 0.5 * (low + high))


def current_slope(u: Floats, q: Mapping[str, float]) -> Floats:
    return np.interp(u, [q["u_soft"], q["u_firm"]], [q["c_soft"], q["c_firm"]])


EQUATIONS: dict[str, Equation] = {
    "viscous_damping": lambda z, w, u, t, q: (q["c"] + q["c_control"] * u) * w,
    "arctan_damping": lambda z, w, u, t, q: q["F1"] * 2 / np.pi * np.arctan(q["S"] * w) + q["d"] * w + q["F2"],
    "piecewise_linear_damping": lambda z, w, u, t, q: np.where(
        np.abs(q["c1"] * w) < q["f_r"], q["c1"] * w, np.sign(w) * (1 - q["c2"] / q["c1"]) * q["f_r"] + q["c2"] * w
    ),
    "valve_damping": lambda z, w, u, t, q: current_slope(u, q) * w / np.sqrt(1 + (w / q["w_knee"]) ** 2),
    "quadratic_damping": lambda z, w, u, t, q: q["q"] * np.sign(w) * np.minimum(np.abs(w), q["w_cap"] or np.inf) ** 2,
    "relief_valve": lambda z, w, u, t, q: (
        -0.5
        * (q["c_drop"] + q["c_drop_control"] * u)
        * np.sign(w)
        * (np.abs(w) + np.hypot(np.abs(w) - q["w_knee"], q["w_round"]) - np.hypot(q["w_knee"], q["w_round"]))
    ),
    "damping_asymmetry": lambda z, w, u, t, q: (q["c_a"] + q["c_a_control"] * u) * np.abs(w),
    "rebound_compression_damping": lambda z, w, u, t, q: on_side(
        w, (q["c_r"], q["c_c"]), (q["w_r"], q["w_c"]), q["share"]
    ),
    "hydraulic_bump_stop": lambda z, w, u, t, q: (
        q["q"] * (1 + q["side"] * np.sign(z)) * beyond(z, q["z_max"]) * w * np.abs(w)
    ),
    "tanh_hysteresis": lambda z, w, u, t, q: (
        (q["alpha"] + q["alpha_control"] * u) * np.tanh(q["beta"] * w + q["delta"] * np.tanh(z / q["z_r"]))
    ),
    "eddy_current_damping": lambda z, w, u, t, q: 2 * q["f_peak"] * q["w_peak"] * w / (q["w_peak"] ** 2 + w**2),
    "shim_stack_damping": lambda z, w, u, t, q: shims(w, q),
    "linear_stiffness": lambda z, w, u, t, q: q["k"] * z,
    "cubic_stiffness": lambda z, w, u, t, q: q["k3"] * z**3 / (1.0 + q["bend"] * z**2),
    "gas_spring": lambda z, w, u, t, q: (
        -q["f0"] * (1 + q["warm"] * (t - 25) / 298.15) * (1 + z / q["length"]) ** -q["n"]
    ),
    "warm_gas_spring": lambda z, w, u, t, q: (
        -q["f0"] * (t + 273.15) / (q["T_ref"] + 273.15) * (q["length"] / (q["length"] + z)) ** q["n"]
    ),
    "end_stop": lambda z, w, u, t, q: (
        (np.sign(z - q["centre"]) + q["side"])
        * (q["k"] * beyond(z - q["centre"], q["z_max"]) + q["k2"] * beyond(z - q["centre"], q["z_max"]) ** 2)
    ),
    "progressive_stop": lambda z, w, u, t, q: np.where(
        z < q["z_stop"],
        q["k"] * (z - q["z_stop"]) - q["k2"] * (z - q["z_stop"]) ** 2,
        0.0,  # of a stop below zero
    ),
}


def zone(z: Floats, q: Mapping[str, float]) -> Any:
    """1 + gain·½(tanh a − tanh b) by the sum of two logistic curves."""
    from_low, from_high = (2 * (z - q["z_0"] + side * q["half"]) / q["edge"] for side in (1, -1))
    return 1 + q["gain"] * (1 / (1 + np.exp(-from_low)) - 1 / (1 + np.exp(-from_high)))


FACTORS: dict[str, Equation] = {
    "position_dependent_damping": lambda z, w, u, t, q: q["p"] * z**2 + zone(z, q),
    "temperature_fade": lambda z, w, u, t, q: np.exp(-q["kappa"] * (t - q["T_ref"])),
    "zone_damping": lambda z, w, u, t, q: zone(z, q),
    "cavitation": lambda z, w, u, t, q: np.where(
        w * np.sign(q["w_on"]) > 0, np.minimum(1, np.abs(q["w_on"] / w) ** q["m"]), 1
    ),
}
