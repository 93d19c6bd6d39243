"""The gradient by every parameter of every element, against differences extrapolated to a step of nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.physical.elements import CATALOGUE
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from tests.identification.gradients import TYPICAL, continuous, extrapolated, freed
from tests.identification.motions import motion

Floats = NDArray[np.float64]

# What bends or jumps moves its bend with the parameter: there a sample's derivative is one side's, or none.
BENT = {"relief_valve": 1e-5, "piecewise_linear_damping": 1e-5, "end_stop": 1e-5, "cavitation": 1e-5, "free_play": 5e-2,
        "control_delay": 2e-2, "control_hysteresis": 1e-3, "force_delay": 2e-2}  # fmt: skip
BASE = (element("valve_damping", TYPICAL["valve_damping"]), element("coulomb_friction", {"f_c": 40, "w_r": 0.01}))
ALONE = ("relaxing_compliance", "series_dashpot", "series_compliance", "free_play", "aerated_oil", "rubber_bush")


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
    for k in continuous(model):
        full = model.names()[k]
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
        for k in continuous(model):
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
