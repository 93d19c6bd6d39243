"""The force of an element without memory is the equation of its row."""

from __future__ import annotations

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
    values = dict(TYPICAL[name])
    force = simulate(Model(name="m", elements=(element(name, values),)), inputs).force
    expected = EQUATIONS[name](inputs.x, inputs.v, inputs.i, inputs.temperature, values)
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))
    assert np.ptp(force) > 0.0


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
