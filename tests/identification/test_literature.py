"""The models of the literature against their own equations, integrated by another method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.discrepancy.candidates import admissible
from identification.errors import ModelError
from identification.physical.accuracy import numerical_error
from identification.physical.elements import CATALOGUE
from identification.physical.literature import LITERATURE, literature
from identification.physical.model import Model, element
from identification.physical.modelfile import read_model, write_model
from identification.physical.motion import Motion
from identification.physical.simulate import simulate
from identification.record import record_from_run
from identification.scales import scales_of
from tests.identification.specimens import campaign
from tests.identification.test_solver import gradient_error, motion

Floats = NDArray[np.float64]
DT, N, TURN = 1e-3, 1500, 2 * np.pi * 1.5
T = np.arange(N) * DT
X0 = 0.02


def sine(current: float = 0.0) -> Motion:
    return Motion(
        dt=DT, x=X0 * np.sin(TURN * T), v=X0 * TURN * np.cos(TURN * T), a=-X0 * TURN**2 * np.sin(TURN * T),
        i=np.full(N, current), temperature=np.full(N, 25.0), t=T,
    )  # fmt: skip


def rate(t: float) -> float:
    return float(X0 * TURN * np.cos(TURN * t))


def place(t: float) -> float:
    return float(X0 * np.sin(TURN * t))


def states(right: Callable[[float, Floats], list[float]], start: list[float]) -> Floats:
    """States at every sample, by an implicit method of high order and tight tolerance."""
    found = solve_ivp(right, (0.0, T[-1]), start, method="Radau", rtol=1e-9, atol=1e-13, t_eval=T)
    return np.asarray(found.y)


def late_error(force: Floats, expected: Floats, skip: int = 100) -> float:
    return float(np.linalg.norm(force[skip:] - expected[skip:]) / np.linalg.norm(expected[skip:]))


@pytest.mark.parametrize("name", LITERATURE)
def test_every_model_runs_survives_the_file_and_has_an_exact_gradient(name: str, tmp_path: Path) -> None:
    model = literature(name)
    write_model(tmp_path / "model.json", model)
    assert read_model(tmp_path / "model.json") == replace(model)
    assert np.all(np.isfinite(simulate(model, motion()).force))
    assert gradient_error(model, motion()) < 1e-5


def test_no_model_of_the_literature_adds_a_name_to_the_workflow() -> None:
    runs, _ = campaign("none", seed=1)
    records = [record_from_run(run) for run in runs]
    base = Model(name="m", elements=(element("viscous_damping", {"c": 1000.0}),))
    names = admissible(base, records, scales_of(records, 50.0))
    assert set(names) <= {name for name, spec in CATALOGUE.items() if spec.nameable}
    assert "bouc_wen" in names


def test_the_modified_bouc_wen_model_meets_its_own_equations() -> None:
    c0, c1, k0, k1, alpha, beta, gamma, n = 900.0, 20e3, 3e3, 400.0, 8e4, 3e5, 2e5, 2.0

    def right(t: float, s: Floats) -> list[float]:
        y, h = s
        dy = (alpha * h + k0 * (place(t) - y) + c0 * rate(t)) / (c0 + c1)
        w = rate(t) - dy
        return [dy, w - gamma * abs(w) * h * abs(h) ** (n - 1) - beta * w * abs(h) ** n]

    model = literature("modified Bouc–Wen", {
        "series_dashpot.c": c1, "viscous_damping.c": c0, "linear_stiffness.k": k0, "parallel_stiffness.k": k1,
        "bouc_wen.alpha": alpha, "bouc_wen.beta": beta, "bouc_wen.gamma": gamma, "force_offset.F0": 5.0,
    })  # fmt: skip
    y, h = states(right, [0.0, (1.0 / (beta + gamma)) ** (1 / n)])
    dy = (alpha * h + k0 * (sine().x - y) + c0 * sine().v) / (c0 + c1)
    assert late_error(simulate(model, sine()).force, c1 * dy + k1 * sine().x + 5.0, 20) < 1e-6


def test_the_enriched_maxwell_model_meets_its_own_equations_to_the_tolerance_of_the_reference() -> None:
    k1, k2, c2, f1, s, d = 4e6, 3e6, 2e4, 6000.0, 60.0, 9000.0

    def law(v: float) -> float:
        return float(2 / np.pi * f1 * np.arctan(s * v) + d * v)

    def right(t: float, state: Floats) -> list[float]:
        x1, x2 = state
        force = k1 * (place(t) - x1) + k2 * (place(t) - x2)
        low, high = -3.0, 3.0
        for _ in range(90):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if law(middle) < force else (low, middle)
        return [low, low + k2 * (place(t) - x2) / c2]

    model = literature("enriched Maxwell", {
        "relaxing_compliance.k1": k1, "relaxing_compliance.k2": k2, "relaxing_compliance.c2": c2,
        "arctan_damping.F1": f1, "arctan_damping.S": s, "arctan_damping.d": d,
    })  # fmt: skip
    x1, x2 = states(right, [0.0, 0.0])
    expected = k1 * (sine().x - x1) + k2 * (sine().x - x2)
    assert late_error(simulate(model, sine()).force, expected) < 5e-9
    assert numerical_error(model, sine()).relative < 1e-7


def test_the_lugre_model_meets_its_own_equations() -> None:
    s0, s1, fc, fs, ws = 2e5, 300.0, 200.0, 300.0, 0.02

    def dm(w: Floats, m: Floats) -> Floats:
        return np.asarray(w - s0 * np.abs(w) * m / (fc + (fs - fc) * np.exp(-((w / ws) ** 2))))

    [m] = states(lambda t, m: [float(dm(np.array(rate(t)), m[0]))], [fc / s0])
    v = sine().v
    model = literature("LuGre", {
        "lugre_friction.sigma0": s0, "lugre_friction.sigma1": s1, "lugre_friction.f_c": fc, "lugre_friction.f_s": fs,
        "lugre_friction.w_s": ws, "viscous_damping.c": 500.0, "linear_stiffness.k": 0.0,
    })  # fmt: skip
    expected = s0 * m + s1 * dm(v, m) + 500.0 * v
    assert late_error(simulate(model, sine()).force, expected) < 5e-3


def test_the_amplitude_velocity_of_a_sine_is_its_peak_velocity_and_steers_the_modified_tanh() -> None:
    a = {"alpha1": 1013.9, "alpha2": 103.26, "alpha3": -0.4, "alpha4": 0.3, "alpha5": 0.9}
    a |= {"beta1": 2.0, "beta2": -1.1, "delta1": 0.41, "delta2": 0.54}
    model = literature("modified hyperbolic tangent", {f"modulated_tanh_hysteresis.{k}": v for k, v in a.items()})
    u, v_m, inputs = 0.6, X0 * TURN, sine(0.6)
    level = (a["alpha1"] * u + a["alpha2"]) * (a["alpha3"] * v_m**2 + a["alpha4"] * v_m + a["alpha5"])
    slope, shift = a["beta1"] * v_m ** a["beta2"], a["delta1"] * u + a["delta2"]
    expected = level * np.tanh(slope * inputs.v + shift * np.sign(inputs.x)) + 1e3 * inputs.v + 1e3 * inputs.x
    assert simulate(model, inputs).force[1:] == pytest.approx(expected[1:], rel=1e-3)


def test_the_hysteretic_biviscous_model_runs_through_its_six_branches() -> None:
    c_po, c_pr, f_y, v_0 = 800.0, 2e4, 300.0, 0.02
    model = literature("nonlinear hysteretic biviscous", {
        "hysteretic_biviscous.c_po": c_po, "hysteretic_biviscous.c_pr": c_pr, "hysteretic_biviscous.f_y": f_y,
        "hysteretic_biviscous.v_0": v_0,
    })  # fmt: skip
    v, turn = sine().v, np.sign(sine().a)
    v_1, v_2 = (f_y - c_pr * v_0) / (c_pr - c_po), (f_y + c_pr * v_0) / (c_pr - c_po)
    rising = np.select([v <= -v_1, v <= v_2], [c_po * v - f_y, c_pr * (v - v_0)], c_po * v + f_y)
    falling = np.select([v >= v_1, v >= -v_2], [c_po * v + f_y, c_pr * (v + v_0)], c_po * v - f_y)
    expected = np.where(turn > 0, rising, falling)
    assert simulate(model, sine()).force[1:] == pytest.approx(expected[1:], abs=1e-9)


def test_the_generalised_sigmoid_is_that_of_its_exponentials() -> None:
    f_t, alpha, h, k_v = 400.0, 60.0, 0.15, 2.0
    model = literature("generalised sigmoid", {
        "sigmoid_hysteresis.F_t": f_t, "sigmoid_hysteresis.alpha": alpha, "sigmoid_hysteresis.h": h,
        "sigmoid_hysteresis.k_v": k_v, "linear_stiffness.k": 0.0,
    })  # fmt: skip
    q = np.exp(-alpha * (sine().v - h * X0 * TURN * np.sign(sine().a)))
    expected = f_t * (1 - q) / (1 + q) * (1 + k_v * np.abs(sine().v))
    assert simulate(model, sine()).force[1:] == pytest.approx(expected[1:], rel=1e-3, abs=1.0)


def test_what_stands_alone_on_the_mount_is_refused_beside_another() -> None:
    viscous, dashpot = element("viscous_damping", {"c": 1.0}), element("series_dashpot", {"c": 1.0})
    with pytest.raises(ModelError, match="'series_dashpot' beside another"):
        Model(name="m", elements=(viscous, dashpot, element("free_play", {"gap": 1e-3})))
