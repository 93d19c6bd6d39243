"""Elements that are limits of richer ones: they start out of a fit of these, and with the same force."""

from __future__ import annotations

import numpy as np
import pytest

from identification.discrepancy.candidates import starts_out_of
from identification.physical.elements import CATALOGUE, Growth
from identification.physical.model import Model, element
from identification.physical.simulate import simulate
from identification.scales import scales_of
from tests.identification.motions import motion
from tests.identification.specimens import records_with

LIMITS = [
    ("lugre_friction", {"sigma0": 1e8, "sigma1": 0.0, "f_c": 60.0, "f_s": 90.0, "w_s": 0.05}, "stribeck_friction"),
    ("lugre_friction", {"sigma0": 2e5, "sigma1": 0.0, "f_c": 60.0, "f_s": 60.0, "w_s": 0.05}, "presliding_friction"),
    ("bouc_wen", {"alpha": 2e5, "A": 1.0, "n": 1.0, "beta": 0.0, "gamma": 2e3}, "presliding_friction"),
    ("presliding_friction", {"sigma": 1e9, "f_c": 60.0}, "coulomb_friction"),
    ("stribeck_friction", {"f_c": 60.0, "f_s": 60.0, "w_s": 0.05}, "coulomb_friction"),
    ("aerated_oil", {"air": 1e-2, "f_half": 1e3}, "series_compliance"),
    ("aerated_oil", {"air": 2e-3, "f_half": 0.05}, "free_play"),
]
DASHPOT = element("viscous_damping", {"c": 100.0})


def test_every_limit_is_tried_here() -> None:
    declared = {(g.of, name) for name, spec in CATALOGUE.items() for g in spec.limits_of}
    assert {(richer, name) for richer, _, name in LIMITS} == declared


@pytest.mark.parametrize(("richer", "values", "name"), LIMITS)
def test_a_limit_starts_with_the_force_of_what_it_is_the_limit_of(
    richer: str, values: dict[str, float], name: str
) -> None:
    fitted = element(richer, values)
    growth = next(g for g in CATALOGUE[name].limits_of if g.of == richer)
    scales = scales_of(records_with("coulomb_friction"), 50.0)
    limit = starts_out_of(fitted, name, growth, scales)[0]
    inputs = motion(2.0, 0.02)
    wanted, has = (simulate(Model(name="m", elements=(e, DASHPOT)), inputs).force for e in (fitted, limit))
    differ = np.abs(has - wanted) > 0.03 * np.max(np.abs(wanted))
    assert np.count_nonzero(differ) <= 0.03 * wanted.size  # at the reversals a bristle turns within a few samples


GROWTHS = [
    (growth, name)
    for name, spec in CATALOGUE.items()
    for growth in (*spec.limits_of, *([spec.growth] if spec.growth else []))
]


@pytest.mark.parametrize(("growth", "name"), GROWTHS, ids=lambda one: one if isinstance(one, str) else one.of)
def test_what_starts_out_of_an_element_on_its_bounds_lies_within_its_own(growth: Growth, name: str) -> None:
    scales = scales_of(records_with("coulomb_friction"), 50.0)
    richer = CATALOGUE[growth.of]
    lowest = element(growth.of, {p.name: max(p.low, -1.0) for p in richer.parameters})
    for start in starts_out_of(lowest, name, growth, scales):
        for spec, p in zip(start.spec.parameters, start.parameters, strict=True):
            assert spec.low <= p.value <= spec.high
