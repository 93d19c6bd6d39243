"""The force of an element without memory is the equation of its row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.physical.elements import CATALOGUE, Family
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.equations import EQUATIONS, FACTORS
from tests.identification.gradients import TYPICAL
from tests.identification.motions import motion


def test_no_element_of_damping_or_spring_is_left_out() -> None:
    assert set(EQUATIONS) == {n for n, s in CATALOGUE.items() if s.family in (Family.DAMPING, Family.SPRING)}


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_force_of_an_element_is_the_equation_of_its_row(name: str) -> None:
    inputs = motion(3.0, 0.02)
    states = {p.name for p in CATALOGUE[name].parameters if p.remembers}
    values = {p: v for p, v in TYPICAL[name].items() if p not in states}
    force = simulate(Model(name="m", elements=(element(name, values),)), inputs).force
    expected = EQUATIONS[name](inputs.x, inputs.v, inputs.i, inputs.temperature, values)
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))
    assert np.ptp(force) > 0.0


def test_an_asymmetry_takes_a_share_of_all_other_damping_and_of_no_friction_or_spring() -> None:
    inputs, own = motion(3.0, 0.02), dict(TYPICAL["damping_asymmetry"])
    curves = ("arctan_damping", "viscous_damping", "tanh_hysteresis")
    beside = {"coulomb_friction": {"f_c": 30.0}, "linear_stiffness": {"k": 2e3}}
    rows = {n: dict(TYPICAL[n]) for n in curves} | beside
    damper = Model(name="m", elements=tuple(element(n, v) for n, v in rows.items()))
    every = (inputs.x, inputs.v, inputs.i, inputs.temperature)
    held = {n: {**v, "F2": 0.0} if "F2" in v else v for n, v in rows.items()}  # a constant is no damping
    damping = np.sum([EQUATIONS[n](*every, held[n]) for n in curves], axis=0)
    added = EQUATIONS["damping_asymmetry"](*every, own) + own["share"] * np.abs(damping)
    force = simulate(damper.with_element(element("damping_asymmetry", own)), inputs).force
    np.testing.assert_allclose(force - simulate(damper, inputs).force, added, rtol=1e-9, atol=1e-9)
    # Two of them lean by the sum of their shares, and a mount changes nothing but what it gives.
    twice = damper.with_element(element("damping_asymmetry", own)).with_element(
        replace(element("damping_asymmetry", {**own, "c_a": 0.0, "c_a_control": 0.0}), id="damping_asymmetry#2")
    )
    more = simulate(twice, inputs).force - simulate(damper, inputs).force
    np.testing.assert_allclose(more, added + own["share"] * np.abs(damping), rtol=1e-9, atol=1e-9)


def test_no_modifier_without_memory_is_left_out() -> None:
    assert set(FACTORS) == {n for n, s in CATALOGUE.items() if s.family == Family.MODIFIER and not s.memory}


@pytest.mark.parametrize("name", FACTORS)
def test_a_modifier_multiplies_damping_and_friction_and_no_spring(name: str) -> None:
    inputs, values = motion(3.0, 0.02), dict(TYPICAL[name])
    damping = element("viscous_damping", {"c": 1000.0}), element("coulomb_friction", {"f_c": 30.0})
    spring = element("linear_stiffness", {"k": 2e3})
    force = simulate(Model(name="m", elements=(*damping, spring, element(name, values))), inputs).force
    factor = FACTORS[name](inputs.x, inputs.v, inputs.i, inputs.temperature, values)
    expected = (1000.0 * inputs.v + 30.0 * np.sign(inputs.v)) * factor + 2e3 * inputs.x
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-9)
    assert np.ptp(factor) > 0.05
