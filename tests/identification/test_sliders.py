"""A presliding friction that is sliders: its loops close, as those of a Masing model do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy import explain
from identification.models.motion import Motion
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import gradient_error
from tests.identification.motions import motion
from tests.identification.ordinary import RATE, recorded
from tests.identification.stepped import stepped

Floats = NDArray[np.float64]
SIGMA, LEVEL = 4e4, 80.0


def friction(*, sliders: bool) -> Element:
    return element("presliding_friction", {"sigma": SIGMA, "f_c": LEVEL, "sliders": float(sliders)})


def model(*elements: Element) -> Model:
    return Model(name="friction", elements=elements)


def along(turns: list[float], *, step: float = 1e-5) -> tuple[Motion, list[int]]:
    """A motion at constant speed from turn to turn, m, out of rest, and the sample at each turn."""
    ways = [np.linspace(a, b, 1 + round(abs(b - a) / step))[1:] for a, b in zip([0.0, *turns], turns, strict=False)]
    x = np.concatenate([np.zeros(2), *ways])
    v = np.gradient(x, 1e-3)
    none = np.zeros(x.size)
    at = np.cumsum([w.size for w in ways]) + 1
    return Motion(dt=1e-3, x=x, v=v, a=none, i=none, temperature=none, t=1e-3 * np.arange(x.size)), at.tolist()


def test_a_small_loop_within_a_large_one_closes_and_leaves_no_trace() -> None:
    with_loop, at = along([0.003, 0.001, 0.002, 0.001, -0.003])
    without, _ = along([0.003, -0.003])
    sliding, one = (simulate(model(friction(sliders=s)), with_loop).force for s in (True, False))
    assert sliding[at[3]] == pytest.approx(sliding[at[1]], abs=1e-6 * LEVEL)
    assert abs(one[at[3]] - one[at[1]]) > 0.05 * LEVEL
    plain = simulate(model(friction(sliders=True)), without).force
    rest = sliding.size - at[3]
    np.testing.assert_allclose(sliding[-rest + 20 :], plain[-rest + 20 :], atol=1e-6 * LEVEL)


def test_the_force_builds_up_as_that_of_one_bristle_from_rest_and_over_twice_the_travel_from_a_turn() -> None:
    there, at = along([0.01, -0.01])
    force = simulate(model(friction(sliders=True)), there).force
    up, down = slice(2, at[0]), slice(at[0] + 1, None)
    travel = there.x[up]
    np.testing.assert_allclose(force[up], LEVEL * (1.0 - np.exp(-SIGMA * travel / LEVEL)), atol=0.06 * LEVEL)
    travel = there.x[at[0]] - there.x[down]
    expected = LEVEL - 2.0 * LEVEL * (1.0 - np.exp(-SIGMA * travel / (2.0 * LEVEL)))
    np.testing.assert_allclose(force[down], expected, atol=0.12 * LEVEL)


@pytest.mark.parametrize("mounted", [False, True])
def test_its_gradient_is_that_of_its_force(mounted: bool) -> None:
    own = friction(sliders=True)
    free = tuple(replace(p, fixed=bool(s.switch)) for p, s in zip(own.parameters, own.spec.parameters, strict=True))
    parts = [element("viscous_damping", {"c": 300.0, "c_control": 0.0}), Element(own.name, free)]
    if mounted:
        parts.insert(0, element("series_compliance", {"k": 4e5, "c": 100.0}))
    assert gradient_error(model(*parts), motion()) < 0.02


@pytest.mark.parametrize("mounted", [False, True])
def test_step_by_step_it_makes_the_same_force(mounted: bool) -> None:
    parts = [element("viscous_damping", {"c": 300.0, "c_control": 0.0}), friction(sliders=True)]
    if mounted:
        parts.insert(0, element("series_compliance", {"k": 4e5, "c": 100.0}))
    force = model(*parts).force(motion())
    late = slice(force.size // 2, None)
    assert np.max(np.abs(stepped(model(*parts), motion()) - force)[late]) <= 2e-3 * np.ptp(force)


@pytest.mark.parametrize("name", ["presliding_friction", "lugre_friction", "bouc_wen"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_machine_that_stands_begins_without_the_force_of_its_last_motion(name: str, sign: float) -> None:
    """The sign of what is left of a velocity at rest is chance."""
    first = {
        "presliding_friction": {"sigma": SIGMA, "f_c": LEVEL},
        "lugre_friction": {"sigma0": SIGMA, "sigma1": 0.0, "f_c": LEVEL, "f_s": LEVEL, "w_s": 0.1},
        "bouc_wen": {"alpha": 1e5, "A": 1.0, "n": 2.0, "beta": 1e5, "gamma": 1e5},
    }[name]
    late = along([0.01, -0.01])[0]
    v = late.v.copy()
    v[0] = sign * 1e-4 * np.max(np.abs(v))
    assert simulate(model(element(name, first)), replace(late, v=v)).force[0] == pytest.approx(0.0, abs=0.01 * LEVEL)


def springs_that_slip(x: Floats) -> Floats:
    """Four springs in parallel; each slips at a fourth of 60 N, after 1, 3, 5 and 7 mm."""
    travels, state, force = np.array([1e-3, 3e-3, 5e-3, 7e-3]), np.zeros(4), np.zeros(x.size)
    for k in range(1, x.size):
        state = np.clip(state + (x[k] - x[k - 1]) / travels, -1.0, 1.0)
        force[k] = 15.0 * state.sum()
    return force


@pytest.mark.slow
def test_springs_that_slip_one_after_the_other_are_one_presliding_friction_and_nothing_else() -> None:
    runs = []
    for k, size in enumerate((8e-3, 3e-3, 5e-3, 2e-3, 6e-3)):
        rng = np.random.default_rng([7, k])
        t = np.arange(round(14.0 * RATE)) / RATE
        lines, turns = rng.uniform(0.3, 2.5, 12), rng.uniform(0.0, 6.3, 12)
        swell = np.clip(t - 1.0, 0.0, 1.0)
        waves = 2.0 * np.pi * np.outer(t, lines) + turns
        x = size / 3.0 * swell * np.sin(waves).sum(axis=1)
        v = np.gradient(x, t)
        runs.append(recorded("slip", k, x, 20_000.0 * x + 250.0 * v + springs_that_slip(x), noise=0.5))
    base = model(element("linear_stiffness", {"k": 18_000.0}), element("viscous_damping", {"c": 300.0}))
    found = explain(base, runs[:4], runs[4:])
    assert [e.element for e in found.effects] == ["presliding_friction"]
    assert found.model.element("presliding_friction").value("sliders") == 1.0
    assert found.model.element("presliding_friction").value("f_c") == pytest.approx(60.0, rel=0.1)
    assert any(
        note.startswith("presliding friction: sliders that give way one after the other") for note in found.notes
    )
    assert found.held_out.closed is not None
    assert found.held_out.closed > 0.85  # 0.7 as one bristle
