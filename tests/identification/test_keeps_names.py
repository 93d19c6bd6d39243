"""A name is needless only where the others are, without it, still what their names say."""

from __future__ import annotations

import numpy as np
import pytest

from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Compared, Search, repeat_trials
from identification.discrepancy.needless import drop_needless
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.model import Model, element, keeps_names
from identification.record import Record, record_from_run
from tests.identification.ordinary import motion, recorded

BASE = element("viscous_damping", {"c": 1500.0})
VALVE = element("arctan_damping", {"F1": 300.0, "S": 18.0, "d": 0.0})
FALLS = element("stribeck_friction", {"f_c": 25.0, "f_s": 40.0, "w_s": 0.02})
BOTH = ("arctan_damping", "stribeck_friction")


@pytest.fixture(scope="module")
def records() -> list[Record]:
    found = []
    for k, amplitude in enumerate((0.006, 0.02)):
        _, x, v = motion(k, amplitude)
        friction = (25.0 + 15.0 * np.exp(-((v / 0.02) ** 2))) * np.sign(v)
        force = 1500.0 * v + 300.0 * 2.0 / np.pi * np.arctan(18.0 * v) + friction
        found.append(record_from_run(recorded("valve", k, x, force)))
    return found


@pytest.fixture(scope="module")
def both(records: list[Record]) -> Fit:
    return fit_records(Model(name="m", elements=(BASE, VALVE, FALLS)), records)


def a_search(fit: Fit, names: tuple[str, ...]) -> Search:
    """A search that would miss none of its names by what the fit leaves."""
    compared = {n: Compared(without=fit, start=fit, beside=(), rivals=()) for n in names}
    given = Model(name="m", elements=(BASE,))
    return Search(fit=fit, names=names, excess=1e12, given=given, base_excess=2e12, compared=compared)


def test_without_the_valve_the_friction_would_rise_with_speed(both: Fit, records: list[Record]) -> None:
    alone = fit_records(both.model.without("arctan_damping"), records)
    assert alone.model.element("stribeck_friction").value("f_s") < alone.model.element("stribeck_friction").value("f_c")
    assert excess_of(alone) < 1e12
    assert keeps_names(both.model, both.model)
    assert not keeps_names(alone.model, both.model)
    assert keeps_names(alone.model, alone.model)  # what denied its name before does so still


def test_a_name_stays_where_another_would_deny_its_own_without_it(both: Fit, records: list[Record]) -> None:
    assert repeat_trials(a_search(both, BOTH), "arctan_damping", records, trials=lambda *_, **__: []).names == BOTH
    assert "arctan_damping" in drop_needless(a_search(both, BOTH), records).names


def test_a_name_goes_where_the_others_stay_what_they_are_without_it(both: Fit, records: list[Record]) -> None:
    kept = repeat_trials(a_search(both, BOTH), "stribeck_friction", records, trials=lambda *_, **__: [])
    assert kept.names == ("arctan_damping",)
