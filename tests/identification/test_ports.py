"""Turbulent ports beside a blow-off valve: beyond the pressure at which it opens the flow of the ports stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy import explain
from identification.discrepancy.candidates import guesses
from identification.physical.model import Model, denies_its_name, element
from identification.scales import scales_of
from tests.identification.ordinary import campaign
from tests.identification.specimens import AS_SIMULATED, records_with

Floats = NDArray[np.float64]
OPENS_N = 620.0


def ports_and_valve(x: Floats, v: Floats) -> Floats:
    """Force of a piston whose ports have a laminar and a turbulent loss, beside a valve that opens at a pressure."""
    force = np.linspace(0.0, 6000.0, 20001)
    through_ports = (-900.0 + np.sqrt(900.0**2 + 4.0 * 5200.0 * force)) / (2.0 * 5200.0)
    over = force - OPENS_N
    through_valve = 0.5 * (over + np.hypot(over, 40.0) - (np.hypot(OPENS_N, 40.0) - OPENS_N)) / 500.0
    return np.asarray(np.sign(v) * np.interp(np.abs(v), through_ports + through_valve, force))


@pytest.mark.slow
def test_ports_and_valve_are_both_named_and_the_gap_closes() -> None:
    base = Model(name="viscous", elements=(element("viscous_damping", {"c": 2500.0}, ("c_control",)),))
    found = explain(base, campaign("ports", ports_and_valve, (0.01, 0.03, 0.05, 0.07, 0.04)))
    assert {e.element for e in found.effects} == {"relief_valve", "quadratic_damping"}
    assert found.verdict == "explained"
    values = {e.name: e.values() for e in found.model.elements}
    assert values["quadratic_damping"]["w_cap"] == pytest.approx(values["relief_valve"]["w_knee"], rel=0.35)


def test_a_flow_that_stays_has_a_valve_that_takes_the_rest() -> None:
    capped = element("quadratic_damping", {"q": 5000.0, "w_cap": 0.2})
    valve = element("relief_valve", {"c_drop": 300.0, "w_knee": 0.2})
    assert denies_its_name(capped, AS_SIMULATED.with_element(capped))
    assert not denies_its_name(capped, replace(AS_SIMULATED, elements=(*AS_SIMULATED.elements, valve, capped)))


def test_without_the_valve_the_flow_does_not_stay() -> None:
    capped = element("quadratic_damping", {"q": 5000.0, "w_cap": 0.2})
    valve = element("relief_valve", {"c_drop": 300.0, "w_knee": 0.2})
    both = Model(name="ports", elements=(element("viscous_damping", {"c": 900.0}), capped, valve))
    assert both.in_its_absence("relief_valve").element("quadratic_damping").values()["w_cap"] == 0.0
    assert both.without("relief_valve").element("quadratic_damping").values()["w_cap"] == 0.2


def test_the_plain_law_is_the_first_that_is_tried() -> None:
    plain, *capped = guesses("quadratic_damping", scales_of(records_with("none"), gap=50.0))
    assert plain.values()["w_cap"] == 0.0
    assert all(e.values()["w_cap"] > 0.0 for e in capped)
