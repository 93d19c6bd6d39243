"""A rubber bush with friction beside its spring: stiff for small motion, softer for large, behind it any core."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.physical.model import Model, element
from identification.physical.mount import slip
from identification.physical.program import Mount
from identification.physical.simulate import simulate
from tests.identification.made_runs import PERIOD, PERIODS, RATE_HZ, inputs
from tests.identification.motions import T, motion
from tests.identification.recovered import assert_found, fitted

Floats = NDArray[np.float64]

C = 3000.0  # N·s/m, of the core
BUSH = {"k": 4e5, "c": 0.0, "k_slip": 5e5, "f_slip": 120.0}
MODEL = Model(name="bush", elements=(element("viscous_damping", {"c": C}), element("rubber_bush", BUSH)))


def bush(k_slip: float, f_slip: float) -> Mount:
    none = dict.fromkeys(Mount._fields, 0.0)
    return Mount(**{**none, "k": 1.0, "k_slip": k_slip, "f_slip": f_slip})


@given(
    k=st.floats(1e3, 1e7), top=st.floats(1.0, 1e4), start=st.floats(-1.0, 1.0), travel=st.floats(-1e-2, 1e-2),
    part=st.floats(0.0, 1.0),
)  # fmt: skip
def test_a_leg_one_way_is_the_sum_of_its_parts_and_friction_stays_within_its_highest_force(
    k: float, top: float, start: float, travel: float, part: float
) -> None:
    mount = bush(k, top)
    whole = slip(mount, start * top, travel).y
    first = slip(mount, start * top, part * travel).y
    assert slip(mount, first, (1.0 - part) * travel).y == pytest.approx(whole, rel=1e-9, abs=1e-9 * top)
    assert abs(whole) <= top * (1 + 1e-12)


def force_of(t: Floats, velocity: str) -> Floats:
    """Force of a viscous core behind that bush, (N,), N, by another integrator."""

    def rates(now: float, state: Floats) -> list[float]:
        v = float(inputs(np.asarray(now))[1]) if velocity == "made" else float(np.interp(now, t, motion().v[: t.size]))
        e, y = state
        r = v - (BUSH["k"] * e + y) / C
        return [r, BUSH["k_slip"] * r * (1.0 - np.sign(r) * y / BUSH["f_slip"])]

    found = solve_ivp(rates, (t[0], t[-1]), [0.0, 0.0], method="LSODA", t_eval=t, rtol=1e-7, atol=1e-9, max_step=5e-3)
    return np.asarray(BUSH["k"] * found.y[0] + found.y[1])


def test_it_meets_another_integrator() -> None:
    expected = force_of(T[:600], "motion")
    force = simulate(MODEL, motion()).force[:600]
    assert np.linalg.norm((force - expected)[100:]) < 2e-3 * np.linalg.norm(expected[100:])


def test_its_dynamic_stiffness_falls_with_the_amplitude() -> None:
    """Against a core that all but stands still: the peak force over the peak travel."""
    wall = element("viscous_damping", {"c": 1e9})
    stiffness = []
    for amplitude in (1e-5, 1e-4, 1e-3, 1e-2):
        m = motion(2.0, amplitude)
        force = simulate(Model(name="wall", elements=(wall, element("rubber_bush", BUSH))), m).force
        stiffness.append(np.ptp(force[500:]) / np.ptp(m.x[500:]))
    assert np.all(np.diff(stiffness) < 0.0)
    assert stiffness[0] > 0.9 * (BUSH["k"] + BUSH["k_slip"])
    assert stiffness[-1] == pytest.approx(BUSH["k"], rel=0.05)


def test_a_fit_finds_its_spring_and_its_friction() -> None:
    t = np.arange(PERIOD * PERIODS) / RATE_HZ
    force = force_of(t, "made")
    force[:PERIOD] = force[PERIOD : 2 * PERIOD]  # as if it had always been so
    rubber = element("rubber_bush", BUSH, fixed=("c",))
    model, free = fitted(lambda *_: force, [element("viscous_damping", {"c": C}), rubber])
    assert len(free) == 4
    assert_found(model, free, {**BUSH, "c": C})
