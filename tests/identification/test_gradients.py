"""The gradient by every parameter of every element, against differences extrapolated to a step of nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.physical.elements import CATALOGUE
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import extrapolated, freed
from tests.identification.motions import motion

Floats = NDArray[np.float64]

# A typical value of each element's parameters for a damper of some hundred newton at 20 mm.
TYPICAL: dict[str, dict[str, float]] = {
    "viscous_damping": {"c": 100, "c_control": 50},
    "arctan_damping": {"F1": 300, "S": 30, "d": 100, "F2": 3},
    "piecewise_linear_damping": {"c1": 3000, "c2": 400, "f_r": 200},
    "valve_damping": {"c_soft": 800, "c_firm": 4000, "u_soft": 0.2, "u_firm": 1.7, "w_knee": 0.4},
    "quadratic_damping": {"q": 300},
    "rebound_compression_damping": {"c_r": 2000, "w_r": 0.1, "c_c": 800, "w_c": 0.15, "share": 0.2},
    "hydraulic_bump_stop": {"q": 4e4, "z_max": 0.004},
    "relief_valve": {"c_drop": 200, "w_knee": 0.1},
    "damping_asymmetry": {"c_a": 100},
    "tanh_hysteresis": {"alpha": 80, "alpha_control": 10, "beta": 30, "delta": 0.3, "z_r": 0.002},
    "bouc_wen": {"alpha": 1e5, "A": 1, "n": 1.7, "beta": 1e4, "gamma": 1e4, "alpha_control": 2e4},
    "coulomb_friction": {"f_c": 60, "w_r": 0.01},
    "stribeck_friction": {"f_c": 50, "f_s": 90, "w_s": 0.05, "w_r": 0.01},
    "presliding_friction": {"sigma": 4e4, "f_c": 80},
    "lugre_friction": {"sigma0": 4e4, "sigma1": 20, "f_c": 80, "f_s": 100, "w_s": 0.05},
    "modulated_tanh_hysteresis": {"alpha1": 1, "alpha2": 0.5, "alpha3": -50, "alpha4": 100, "alpha5": 80, "beta1": 20,
                                  "beta2": -0.4, "delta1": 0.2, "delta2": 0.4},
    "hysteretic_biviscous": {"c_po": 300, "c_pr": 3000, "f_y": 100, "f_y_control": 50, "v_0": 0.01},
    "sigmoid_hysteresis": {"F_t": 100, "F_t_control": 30, "alpha": 40, "h": 0.1, "k_v": 1},
    "linear_stiffness": {"k": 4000},
    "cubic_stiffness": {"k3": 1e6},
    "gas_spring": {"f0": 200, "length": 0.12, "n": 1.3},
    "end_stop": {"k": 3e4, "z_max": 0.012},
    "position_dependent_damping": {"p": 200},
    "temperature_fade": {"kappa": 0.01, "T_ref": 25},
    "reversal_force_lag": {"length": 0.004},
    "series_compliance": {"k": 1.2e6, "c": 300},
    "relaxing_compliance": {"k1": 1.2e6, "k2": 4e5, "c2": 3e3},
    "series_dashpot": {"c": 5e4, "c_control": 1e4},
    "free_play": {"gap": 1e-3},
    "control_lag": {"tau": 0.012},
    "control_delay": {"tau": 0.0123},
    "control_saturation": {"i_s": 1.0},
    "control_hysteresis": {"h": 0.1},
    "force_delay": {"tau": 0.0034},
    "force_offset": {"F0": 7},
    "moving_mass": {"m": 2},
    "parallel_stiffness": {"k": 300},
    "force_drift": {"rate": 3},
    "mains_hum": {"amplitude": 5, "frequency": 50, "phase": 0.4},
}  # fmt: skip
# What bends or jumps moves its bend with the parameter: there a sample's derivative is one side's, or none.
BENT = {"relief_valve": 1e-5, "piecewise_linear_damping": 1e-5, "end_stop": 1e-5, "free_play": 5e-2,
        "control_delay": 2e-2, "control_hysteresis": 1e-3, "force_delay": 2e-2}  # fmt: skip
BASE = (element("valve_damping", TYPICAL["valve_damping"]), element("coulomb_friction", {"f_c": 40, "w_r": 0.01}))
ALONE = ("relaxing_compliance", "series_dashpot", "series_compliance", "free_play")


def test_every_element_has_a_typical_value() -> None:
    assert set(TYPICAL) == set(CATALOGUE)
    for name, spec in CATALOGUE.items():
        assert set(TYPICAL[name]) == {p.name for p in spec.parameters}, name


CASES = [(name, mounted) for name in CATALOGUE for mounted in (False, True) if not (mounted and name in ALONE)]


@pytest.mark.parametrize(("name", "mounted"), CASES)
def test_the_gradient_by_every_parameter_is_that_of_the_force(name: str, mounted: bool) -> None:
    mount = (element("series_compliance", TYPICAL["series_compliance"]),) if mounted else ()
    model = Model(name="m", elements=(*BASE, freed(element(name, TYPICAL[name])), *mount))
    gradient = simulate(model, motion(), gradient=True).gradient
    assert gradient is not None
    for k, full in enumerate(model.names()):
        if not full.startswith(f"{name}."):
            continue
        expected = extrapolated(model, k)
        size = max(float(np.sqrt(np.mean(expected**2))), 1e-12)
        off = float(np.median(np.abs(gradient[:, k] - expected))) / size
        assert off < BENT.get(name, 1e-6), f"{full}: {off:.1e}"


def test_memories_begin_with_the_sensitivity_of_their_steady_value() -> None:
    for name in ("bouc_wen", "presliding_friction", "lugre_friction"):
        model = Model(name="m", elements=(freed(element(name, TYPICAL[name])),))
        gradient = simulate(model, motion(), gradient=True).gradient
        assert gradient is not None
        for k in range(gradient.shape[1]):
            expected = extrapolated(model, k)
            assert gradient[:20, k] == pytest.approx(expected[:20], rel=1e-5, abs=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("which", [(0,), (1, 4), (2, 3, 5, 8), ()])
@pytest.mark.parametrize("mounted", [False, True])
def test_a_gradient_by_some_parameters_is_those_columns_of_the_whole(which: tuple[int, ...], mounted: bool) -> None:
    mount = (element("series_compliance", TYPICAL["series_compliance"]),) if mounted else ()
    others = [freed(element(n, TYPICAL[n])) for n in ("bouc_wen", "control_lag", "moving_mass", "force_drift")]
    model = Model(name="m", elements=(*BASE, *others, *mount))
    every = simulate(model, motion(), gradient=True).gradient
    mask = np.zeros(len(model.names()), dtype=np.bool_)
    mask[[2 * k % mask.size for k in which]] = True
    some = simulate(model, motion(), gradient=mask).gradient
    assert every is not None
    assert some is not None
    assert some.shape[1] == len(which)
    assert np.array_equal(some, every[:, mask])
