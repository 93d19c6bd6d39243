"""Bouc–Wen hysteresis in the solver: bolted to the rig, behind a dashpot, and behind what is too stiff for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.errors import ModelError, SimulationError
from identification.models.motion import Motion
from identification.physical.accuracy import numerical_error, simulate_within
from identification.physical.elements.equations.friction import BoucWen
from identification.physical.elements.equations.memory import PARTIALS, bouc_wen_leg, fading
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import continuous, extrapolated, freed
from tests.identification.motions import DT, N, T, motion

Floats = NDArray[np.float64]

WEN = {"alpha": 1e5, "A": 1.2, "n": 1.7, "beta": 2e4, "gamma": 3e4, "alpha_control": 2e4}
DASHPOT = element("series_dashpot", {"c": 8e3, "c_control": 2e3})
LINEAR = (
    element("viscous_damping", {"c": 600, "c_control": 200}),
    element("linear_stiffness", {"k": 3e3}),
    element("cubic_stiffness", {"k3": 1e6}),
    element("position_dependent_damping", {"p": 100}),
    element("control_lag", {"tau": 0.01}),
)


@pytest.mark.parametrize("n", [1.0, 1.9, 4.0])
@pytest.mark.parametrize("travel", [0.05, 1e15])
def test_what_grows_as_it_is_loaded_comes_to_its_top_however_far_it_travels(n: float, travel: float) -> None:
    """A solver that is lost may ask for any travel, and must have its answer at once."""
    partials = np.ones(PARTIALS)
    height = (1.0 / 400.0) ** (1.0 / n)  # far below a travel of 0.05 m
    q = BoucWen(alpha=1e5, A=1.0, n=n, beta=-1.0, gamma=1.0 - 1.0 / height**n, alpha_control=0.0)
    assert q.beta + q.gamma < 0.0
    far = fading(q, n)
    ends = [bouc_wen_leg(q, n, 0.0, way, 1.0, True, partials) for way in (31.9 * far, travel + 33.0 * far)]
    assert ends[0] == ends[1] == pytest.approx(1e3 * height)
    assert not np.any(partials[:6])


def bolted(**values: float) -> Model:
    return Model(name="m", elements=(element("bouc_wen", {**WEN, "alpha_control": 0.0, **values}),))


@pytest.mark.parametrize("n", [1.0, 1.7, 2.0, 6.0])
def test_bolted_to_the_rig_it_follows_its_equation_over_many_reversals(n: float) -> None:
    beta, gamma = 0.4 / 2e-3**n, 0.6 / 2e-3**n

    def rate(t: float, h: Floats) -> Floats:
        w = np.interp(t, T, inputs.v)
        return np.asarray(1.2 * w - gamma * abs(w) * h * abs(h) ** (n - 1) - beta * w * abs(h) ** n)

    inputs = motion(2.0, 0.01)
    inputs = replace(inputs, x=np.r_[0.0, np.cumsum(0.5 * DT * (inputs.v[1:] + inputs.v[:-1]))])  # v straight between
    found = solve_ivp(rate, (0.0, T[-1]), [1.2 ** (1 / n) * 2e-3], method="DOP853", rtol=1e-9, atol=1e-13, t_eval=T,
                      max_step=DT)  # fmt: skip
    force = simulate(bolted(n=n, beta=beta, gamma=gamma), inputs).force
    assert np.max(np.abs(force - 1e5 * found.y[0])) < 1e-3 * np.max(np.abs(force))


@pytest.mark.parametrize("n", [1.0, 2.0, 7.3])
def test_however_far_a_step_travels_it_ends_saturated(n: float) -> None:
    inputs = motion(2.0, 0.01)
    for scale in (1.0, 1e3, 1e9):
        far = replace(inputs, x=scale * inputs.x, v=scale * inputs.v)
        force = simulate(bolted(n=n, beta=0.5, gamma=0.5), far).force
        assert np.all(np.abs(force) <= 1e5 * 1.2 ** (1 / n) * (1 + 1e-6))
    assert np.median(np.abs(force)) == pytest.approx(1e5 * 1.2 ** (1 / n))


# Where a parameter decides how many steps a sample takes, differences see the jump from one number to the next.
@pytest.mark.parametrize(
    ("speed", "allowed"), [(1.0, 1e-6), (12.0, 1e-4)], ids=["one step a sample", "several steps a sample"]
)
def test_behind_a_dashpot_the_gradient_is_that_of_the_force(speed: float, allowed: float) -> None:
    elements = tuple(freed(e) for e in (*LINEAR, DASHPOT, element("bouc_wen", WEN)))
    model, inputs = Model(name="m", elements=elements), motion(2.0, 0.02 * speed)
    gradient = simulate(model, inputs, gradient=True).gradient
    assert gradient is not None
    for k in continuous(model):
        expected = extrapolated(model, k, inputs)
        size = float(np.sqrt(np.mean(expected**2)))
        assert float(np.median(np.abs(gradient[:, k] - expected))) < allowed * size, model.names()[k]


def test_behind_a_dashpot_halving_the_step_divides_the_error_by_four_where_it_reverses() -> None:
    model = Model(name="m", elements=(element("viscous_damping", {"c": 600}), element("bouc_wen", WEN), DASHPOT))
    inputs = motion(4.0, 0.03)
    exact = simulate(model, inputs, substeps=32).force
    off = [np.abs(simulate(model, inputs, substeps=n).force - exact)[10:] for n in (1, 2)]
    assert np.linalg.norm(off[0]) > 3.5 * np.linalg.norm(off[1])
    assert np.linalg.norm(off[0]) < 1e-5 * np.linalg.norm(exact)


def test_before_the_first_reversal_the_step_behind_a_dashpot_is_of_fourth_order() -> None:
    turn = 2 * np.pi * 0.4 / (N * DT)  # the velocity falls to 0.3 of its first value, the current drives the memory
    inputs = replace(motion(), x=np.sin(turn * T) / turn, v=np.cos(turn * T), a=-turn * np.sin(turn * T))
    inputs = replace(inputs, i=T.copy())
    model = Model(name="m", elements=(element("viscous_damping", {"c": 600}), element("bouc_wen", WEN), DASHPOT))
    exact = simulate(model, inputs, substeps=32).force
    off = [np.linalg.norm(simulate(model, inputs, substeps=n).force - exact) for n in (1, 2)]
    assert off[0] > 12.0 * off[1]


@pytest.mark.parametrize(
    "mount",
    [element("series_compliance", {"k": 3e6, "c": 50}), element("series_dashpot", {"c": 1e-3})],
    ids=lambda e: e.name,
)
def test_where_the_mount_is_too_stiff_for_an_explicit_step_an_implicit_one_is_taken(mount: Element) -> None:
    model = Model(name="m", elements=(element("viscous_damping", {"c": 600}), element("bouc_wen", WEN), mount))
    inputs = motion(2.0)
    force, exact = simulate(model, inputs).force, simulate(model, inputs, substeps=16).force
    assert np.linalg.norm(force - exact) < 2e-3 * np.linalg.norm(exact)


@pytest.mark.parametrize("n", [1.0, 2.0])
def test_one_that_grows_as_it_is_loaded_follows_its_equation_within_the_stroke(n: float) -> None:
    """As that of Noël & Schoukens' benchmark (2016): beta + gamma below zero, what a reversal unloads is more."""
    inputs = motion(2.0, 0.01)
    inputs = replace(inputs, x=np.r_[0.0, np.cumsum(0.5 * DT * (inputs.v[1:] + inputs.v[:-1]))])
    half = 0.5 * float(np.ptp(inputs.x))
    beta, gamma = -0.55 / half**n, 0.4 / half**n

    def rate(t: float, h: Floats) -> Floats:
        w = np.interp(t, T, inputs.v)
        return np.asarray(w - gamma * abs(w) * h * abs(h) ** (n - 1) - beta * w * abs(h) ** n)

    begin = [np.sign(inputs.v[0]) * half]
    found = solve_ivp(rate, (0.0, T[-1]), begin, method="DOP853", rtol=1e-9, atol=1e-13, t_eval=T, max_step=DT)
    force = simulate(bolted(A=1.0, n=n, beta=beta, gamma=gamma), inputs).force
    assert np.max(np.abs(force - 1e5 * found.y[0])) < 1e-3 * np.max(np.abs(force))


def test_a_hysteresis_without_bound_is_refused_by_name_before_any_work() -> None:
    what = r"bouc_wen.beta \+ bouc_wen.gamma is -1e\+06: below zero the hysteresis grows, here without end within"
    with pytest.raises(SimulationError, match=what):
        simulate(bolted(beta=-1.03e6), motion())
    with pytest.raises(ModelError, match=r"bouc_wen.gamma is -1 1/m\^n: physically it lies within \[0, inf\]"):
        bolted(gamma=-1.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("n", "limit"), [(1.0, 5.2), (2.0, 1.57)])
def test_how_far_it_may_grow_does_not_depend_on_the_unit_of_length(n: float, limit: float, scale: float) -> None:
    """Infinite after a travel of π/2·(beta + gamma)^(−1/2) at n = 2; e⁵-fold, which is as good as that, at n = 1."""
    inputs = motion(2.0, 0.01)
    inputs = replace(inputs, x=scale * inputs.x, v=scale * inputs.v, a=scale * inputs.a)
    stroke = float(np.ptp(inputs.x))
    simulate(bolted(A=1.0, n=n, beta=-((0.95 * limit / stroke) ** n), gamma=0.0), inputs)
    with pytest.raises(SimulationError, match="without end"):
        simulate(bolted(A=1.0, n=n, beta=-((1.05 * limit / stroke) ** n), gamma=0.0), inputs)


def close_to_nyquist(parts: int) -> Motion:
    """Two periods of a multisine up to 0.8 of the Nyquist frequency of a 750 Hz record, `parts` samples for one."""
    period, rate = 512 * parts, 750.0 * parts
    lines = np.arange(3, 205)
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[lines] = period * 4e-3 * np.exp(2j * np.pi * np.random.default_rng(4).random(lines.size)) / lines
    omega = 2j * np.pi * np.fft.rfftfreq(period, 1 / rate)
    x, v, a = (np.tile(np.fft.irfft(spectrum * omega**k, period), 2) for k in range(3))
    n = x.size
    return Motion(dt=1 / rate, x=x, v=v, a=a, i=np.zeros(n), temperature=np.full(n, 25.0), t=np.arange(n) / rate,
                  period=period)  # fmt: skip


@pytest.mark.parametrize("mount", [(), (element("series_dashpot", {"c": 2e4}),)], ids=["bolted", "behind a dashpot"])
def test_close_to_nyquist_the_estimate_owns_up_and_divided_samples_keep_the_tolerance(mount: tuple[Element]) -> None:
    wen = element("bouc_wen", {"alpha": 2e5, "A": 1.0, "n": 1.8, "beta": 2e4, "gamma": 3e4})
    model = Model(name="m", elements=(wen, element("viscous_damping", {"c": 500.0}), *mount))
    coarse, exact = close_to_nyquist(1), simulate(model, close_to_nyquist(64)).force[::64]

    def off(force: Floats) -> float:
        return float(np.linalg.norm((force - exact)[50:]) / np.linalg.norm(exact[50:]))

    plain = off(simulate(model, coarse).force)
    assert 0.7 * plain < numerical_error(model, coarse).relative < 2.0 * plain
    refined = simulate_within(model, coarse, 0.02 * plain)
    assert refined.relative <= 0.02 * plain
    assert off(refined.force) <= 0.02 * plain
