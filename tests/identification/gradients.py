"""A typical value of every parameter of the catalogue, and the gradient of a simulated force from differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.model import Element, Model
from identification.physical.simulate import simulate
from tests.identification.motions import motion

Floats = NDArray[np.float64]

# A typical value of each element's parameters for a damper of some hundred newton at 20 mm.
TYPICAL: dict[str, dict[str, float]] = {
    "viscous_damping": {"c": 100, "c_control": 50},
    "arctan_damping": {"F1": 300, "S": 30, "d": 100, "F2": 3},
    "piecewise_linear_damping": {"c1": 3000, "c2": 400, "f_r": 200},
    "valve_damping": {"c_soft": 800, "c_firm": 4000, "u_soft": 0.2, "u_firm": 1.7, "w_knee": 0.4},
    "quadratic_damping": {"q": 300, "w_cap": 0.2},
    "rebound_compression_damping": {"c_r": 2000, "w_r": 0.1, "c_c": 800, "w_c": 0.15, "share": 0.2},
    "hydraulic_bump_stop": {"q": 4e4, "z_max": 0.004, "side": 0.3},
    "relief_valve": {"c_drop": 200, "w_knee": 0.1, "c_drop_control": 30, "w_round": 0.03},
    "damping_asymmetry": {"c_a": 100, "c_a_control": 40, "share": 0.3},
    "tanh_hysteresis": {"alpha": 80, "alpha_control": 10, "beta": 30, "delta": 0.3, "z_r": 0.002},
    "eddy_current_damping": {"f_peak": 150, "w_peak": 0.15},
    "shim_stack_damping": {"q": 1.5e4, "f_open": 60, "c_shim": 1200, "f_blow": 220, "c_blow": 2000},
    "bouc_wen": {"alpha": 1e5, "A": 1, "n": 1.7, "beta": 1e4, "gamma": 1e4, "alpha_control": 2e4},
    "coulomb_friction": {"f_c": 60, "w_r": 0.01, "beside_mount": 0},
    "stribeck_friction": {"f_c": 50, "f_s": 90, "w_s": 0.05, "w_r": 0.01, "beside_mount": 0},
    "presliding_friction": {"sigma": 4e4, "f_c": 80, "beside_mount": 0, "sliders": 0},
    "frequency_selective_damping": {"c": 500, "tau": 0.02},
    "lugre_friction": {"sigma0": 4e4, "sigma1": 20, "f_c": 80, "f_s": 100, "w_s": 0.05, "beside_mount": 0},
    "modulated_tanh_hysteresis": {"alpha1": 1, "alpha2": 0.5, "alpha3": -50, "alpha4": 100, "alpha5": 80, "beta1": 20,
                                  "beta2": -0.4, "delta1": 0.2, "delta2": 0.4},
    "hysteretic_biviscous": {"c_po": 300, "c_pr": 3000, "f_y": 100, "f_y_control": 50, "v_0": 0.01},
    "sigmoid_hysteresis": {"F_t": 100, "F_t_control": 30, "alpha": 40, "h": 0.1, "k_v": 1},
    "linear_stiffness": {"k": 4000, "beside_mount": 0},
    "cubic_stiffness": {"k3": 1e6, "bend": 300.0, "beside_mount": 0},
    "gas_spring": {"f0": 200, "length": 0.12, "n": 1.3, "heat": 0.4, "rested": 0.3, "warm": 0.8, "beside_mount": 0},
    "warm_gas_spring": {"f0": 200, "length": 0.12, "n": 1.3, "T_ref": 25},
    "end_stop": {"k": 3e4, "z_max": 0.012, "side": -0.4, "k2": 4e6, "centre": 0.001, "beside_mount": 0},
    "progressive_stop": {"k": 1e4, "k2": 2e6, "z_stop": -0.01},
    "position_dependent_damping": {"p": 200, "gain": -0.4, "z_0": 0.003, "half": 0.006, "edge": 0.002},
    "temperature_fade": {"kappa": 0.01, "T_ref": 25},
    "zone_damping": {"gain": 0.6, "z_0": 0.003, "half": 0.006, "edge": 0.002},
    "cavitation": {"w_on": -0.1, "m": 0.8},
    "reversal_force_lag": {"length": 0.004},
    "series_compliance": {"k": 1.2e6, "c": 300, "k2": 0, "c2": 1, "k_slip": 1, "f_slip": 0},
    "relaxing_compliance": {"k1": 1.2e6, "k2": 4e5, "c2": 3e3},
    "rubber_bush": {"k": 8e5, "c": 300, "k_slip": 6e5, "f_slip": 60},
    "series_dashpot": {"c": 5e4, "c_control": 1e4},
    "free_play": {"gap": 1e-3, "soft": 5e-4, "f_soft": 60.0},
    "aerated_oil": {"air": 2e-3, "f_half": 80.0, "side": -0.4},
    "control_lag": {"tau": 0.012, "fall": 0.02},
    "coil_lag": {"tau_rise": 0.012, "tau_fall": 0.03},
    "control_delay": {"tau": 0.0123},
    "control_saturation": {"i_s": 1.0},
    "control_hysteresis": {"h": 0.1},
    "force_delay": {"tau": -0.0034, "lag": 0.005, "turn": 0.003, "late_motion": 1.0},
    "force_offset": {"F0": 7},
    "moving_mass": {"m": 2},
    "parallel_stiffness": {"k": 300},
    "force_drift": {"rate": 3},
    "mains_hum": {"amplitude": 5, "frequency": 50, "phase": 0.4},
}  # fmt: skip


def freed(e: Element) -> Element:
    pairs = zip(e.parameters, e.spec.parameters, strict=True)
    return Element(e.name, tuple(replace(p, fixed=bool(spec.switch)) for p, spec in pairs))


def continuous(model: Model) -> list[int]:
    """Places of the parameters that are no switches, nor of a finer shape that is off: to begin is a jump."""
    specs = [(e.parameters[own].value, e.spec.parameters[own]) for e, own in model.slots()]
    return [k for k, (value, s) in enumerate(specs) if not s.switch and not (s.shape and value == s.default)]


def extrapolated(model: Model, k: int, inputs: Motion | None = None) -> Floats:
    """∂force/∂θ_k, (N,): central differences of step h and h/2, their error of order h² taken out."""
    values, inputs = model.values(), inputs or motion()
    differences = []
    for step in (2e-4, 1e-4):
        h = step * max(abs(values[k]), 1e-3)
        forces = []
        for side in (h, -h):
            moved = values.copy()
            moved[k] += side
            forces.append(simulate(model.with_values(moved), inputs).force)
        differences.append((forces[0] - forces[1]) / (2 * h))
    return np.asarray((4 * differences[1] - differences[0]) / 3)


def gradient_error(model: Model, inputs: Motion) -> float:
    """Largest median deviation of the gradient from central differences, relative to each column's size."""
    gradient = simulate(model, inputs, gradient=True).gradient
    assert gradient is not None
    values, worst = model.values(), 0.0
    for k in np.flatnonzero(model.free()):
        step = 1e-5 * max(abs(values[k]), 1e-2)
        up, down = values.copy(), values.copy()
        up[k] += step
        down[k] -= step
        if down[k] < model.bounds()[0][k]:
            continue
        forces = [simulate(model.with_values(v), inputs).force for v in (up, down)]
        column = (forces[0] - forces[1]) / (2 * step)
        size = float(np.sqrt(np.mean(column**2)))
        if size > 0.0:
            worst = max(worst, float(np.median(np.abs(column - gradient[:, k]))) / size)
    return worst
