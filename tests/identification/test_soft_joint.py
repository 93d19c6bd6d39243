"""A joint with play whose halves meet bit by bit: one effect, however they meet."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identification.discrepancy import explain
from identification.physical.damper import mount_of
from identification.physical.elements.mount import RIGID_STIFFNESS
from identification.physical.model import Model, element
from identification.physical.mount import contact
from rigctl.runfile import Run
from tests.identification.ordinary import motion, recorded

Floats = NDArray[np.float64]

DAMPING, PLAY, HARD = 3000.0, 2e-3, 1.5e9  # N·s/m, m, N/m²
BASE = Model(name="viscous", elements=(element("viscous_damping", {"c": 2500.0}),))


def force_of(t: Floats, v: Floats) -> Floats:
    """Force of a viscous valve behind a joint whose contact force is the square of what it is pressed by, (N,), N."""

    def met(e: Floats) -> Floats:
        return np.asarray(np.sign(e) * HARD * np.maximum(np.abs(e) - 0.5 * PLAY, 0.0) ** 2)

    def rate(now: float, e: Floats) -> Floats:
        return np.asarray(np.interp(now, t, v) - met(e) / DAMPING)

    found = solve_ivp(rate, (t[0], t[-1]), [0.0], method="LSODA", t_eval=t, rtol=1e-7, atol=1e-9, max_step=2e-3)
    return met(np.asarray(found.y[0]))


def worn(seed: int, amplitude: float) -> Run:
    t, x, v = motion(seed, amplitude, seconds=8.0)
    return recorded("worn", seed, x, force_of(t, v))


@pytest.mark.slow
def test_a_play_whose_halves_meet_bit_by_bit_is_named_and_nothing_beside_it() -> None:
    runs, held_out = [worn(1, 0.02), worn(2, 0.03), worn(3, 0.012)], [worn(4, 0.025)]
    found = explain(BASE, runs, held_out)
    assert [e.element for e in found.effects] == ["free_play"]
    assert found.verdict == "explained"
    values = found.model.element("free_play").values()
    assert values["gap"] == pytest.approx(PLAY, rel=0.15)
    assert values["soft"] > 0.0
    assert not explain(found.model, runs, held_out).effects


@given(gap=st.floats(1e-5, 1e-2), soft=st.floats(1e-6, 1e-2), f_soft=st.floats(0.1, 1e4), f=st.floats(0.1, 1e4))
def test_the_travel_under_a_force_is_that_of_the_play_and_of_how_its_halves_meet(
    gap: float, soft: float, f_soft: float, f: float
) -> None:
    mount, _ = mount_of([element("free_play", {"gap": gap, "soft": soft, "f_soft": f_soft})], remembers=False)
    e = 0.5 * gap + 0.5 * soft * f / (f_soft + f) + f / RIGID_STIFFNESS
    assert contact(mount, 0.0, e, 0.0).f == pytest.approx(f, rel=1e-5)
    assert contact(mount, 0.0, -e, 0.0).f == pytest.approx(-f, rel=1e-5)
    assert contact(mount, 0.0, 0.499 * gap, 0.0).f == 0.0


def test_beside_free_air_the_air_says_how_the_halves_meet() -> None:
    joint = element("free_play", {"gap": 1e-3, "soft": 5e-4, "f_soft": 60.0})
    air = element("aerated_oil", {"air": 2e-3, "f_half": 80.0})
    mount, _ = mount_of([joint, air], remembers=False)
    assert (mount.gap, mount.air, mount.f_half) == (1e-3, 2e-3, 80.0)
