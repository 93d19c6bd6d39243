"""A presliding friction that is sliders: its loops close, as those of a Masing model do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.model import Element, Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import gradient_error
from tests.identification.motions import motion
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
