"""Tare, slow movements, mounting and removal on the simulated rig: what is found, and what is refused."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from rigctl.device import SAFE_STATES, RigState
from rigctl.errors import Declined, LimitError, ProcedureError, RigError
from rigctl.preparation import Tare
from rigctl.procedures.averages import correlation_samples, mean_of
from rigctl.procedures.criteria import SLOW_M_S, STEP_M
from rigctl.procedures.motion import creep, position
from rigctl.procedures.mounting import MountingSettings, jog, mount, remove
from rigctl.procedures.station import commanded, powered
from rigctl.procedures.tare import TareSettings, tare
from rigctl.transport import Status
from sim_rig.direct import DirectTransport
from tests.sim_rig.laboratory import NOTHING, CutFrom, Laboratory, Person

UNPOWERED = (RigState.INIT, RigState.DISABLED, RigState.FAULT_DISABLED)


def tared(laboratory: Laboratory, settings: TareSettings | None = None) -> Tare:
    with commanded(laboratory.wire, laboratory.clock) as station:
        return tare(station.axis, laboratory.clock, station.identity, settings)


def test_the_uncertainty_of_a_mean_is_that_of_many_means_white_or_correlated() -> None:
    random = np.random.default_rng(5)
    for memory in (0.0, 0.8):
        series = np.zeros((400, 500))
        for k in range(1, 500):
            series[:, k] = memory * series[:, k - 1] + random.standard_normal(400)
        found = [mean_of(one[100:]) for one in series]
        spread = np.std([one.value for one in found])
        stated = np.sqrt(np.mean([one.uncertainty**2 for one in found]))
        assert 0.8 < stated / spread < 1.2
        covered = np.mean([abs(one.value) < 2 * one.uncertainty for one in found])
        assert covered > 0.88
        assert correlation_samples(series[0]) < 4 * (1 + memory) / (1 - memory)


def test_a_tare_is_the_offset_of_the_cell_within_its_stated_uncertainty() -> None:
    random, within = np.random.default_rng(1), 0
    for seed in range(8):
        offset = random.uniform(-600, 600)
        laboratory = Laboratory(NOTHING._replace(offset=offset), seed=seed, noise_n=random.uniform(1, 20))
        found = tared(laboratory, TareSettings(readings=40))
        within += abs(found.offset_n - offset) < 2 * found.uncertainty_n
        assert abs(found.offset_n - offset) < 4 * found.uncertainty_n
        assert found.uncertainty_n < 20
        assert laboratory.rig.controller.state is RigState.DISABLED
    assert within >= 5  # of eight, where 95 % are expected: fewer has a probability of 0.04 %


def test_mains_hum_does_not_shift_a_tare() -> None:
    laboratory = Laboratory(NOTHING._replace(offset=80.0, hum=100.0), speed=1.0, noise_n=2.0)
    found = tared(laboratory, TareSettings(readings=100))
    assert abs(found.offset_n - 80.0) < 2.5 * found.uncertainty_n
    assert found.uncertainty_n < 10.0


def test_a_tare_beyond_its_limit_or_of_an_unsteady_force_is_refused() -> None:
    with pytest.raises(ProcedureError, match="detach the specimen"):
        tared(Laboratory(NOTHING._replace(offset=1200.0)), TareSettings(readings=40))
    with pytest.raises(ProcedureError, match="not steady"):
        tared(Laboratory(NOTHING._replace(drift=15.0)), TareSettings(readings=40))
    with pytest.raises(ProcedureError, match="30 N at most"):
        tared(Laboratory(NOTHING._replace(offset=60.0)), TareSettings(readings=40, limit_n=30.0))


def test_a_tare_is_refused_while_the_piston_moves() -> None:
    laboratory = Laboratory(NOTHING, speed=1.0)
    with commanded(laboratory.wire, laboratory.clock) as station:
        station.axis.enable(0.0, 0.0)
        laboratory.wire.direct(0.01, 0.0, 1.0)
        with pytest.raises(ProcedureError, match="moving"):
            tare(station.axis, laboratory.clock, station.identity)


def a_spring(seed: int) -> tuple[Laboratory, float, float]:
    random = np.random.default_rng(seed)
    stiffness = 10 ** random.uniform(4.3, 5.3)
    preload = random.uniform(-1, 1) * min(stiffness * 0.008, 900.0)
    specimen = NOTHING._replace(stiffness=stiffness, preload=preload, c=2000.0, coulomb=40.0)
    return Laboratory(specimen, seed=seed), stiffness, preload


def test_mounting_ends_without_power_where_the_specimen_carries_no_load() -> None:
    for seed in range(3):
        laboratory, stiffness, preload = a_spring(seed)
        states = list[RigState]()
        person = Person(then=lambda text, states=states, rig=laboratory.rig: states.append(rig.controller.state))
        found = mount(laboratory.wire, laboratory.clock, person)
        left = stiffness * found.zero.displacement_m + preload
        assert abs(left) < 20.0 + 3 * found.zero.uncertainty_n
        assert abs(left - found.zero.force_n) < 4 * found.zero.uncertainty_n
        assert all(state in UNPOWERED for state in states), "hands are at it only without power"
        assert laboratory.rig.controller.state is RigState.DISABLED


def test_the_tare_of_a_mounting_is_taken_before_the_specimen_and_removed_from_its_force() -> None:
    laboratory = Laboratory(NOTHING._replace(offset=300.0, stiffness=4e4, preload=0.0))
    found = mount(laboratory.wire, laboratory.clock, Person(), MountingSettings(tare=TareSettings(readings=60)))
    assert found.tare is not None
    assert found.tare.offset_n == pytest.approx(300.0, abs=5 * found.tare.uncertainty_n)
    assert abs(4e4 * found.zero.displacement_m) < 25.0


def test_slow_movements_are_slow() -> None:
    laboratory = Laboratory(NOTHING._replace(c=500.0))
    positions = laboratory.commands
    here = jog(laboratory.wire, laboratory.clock, to_m=0.01)
    assert here.displacement_m == pytest.approx(0.01, abs=1e-4)
    assert np.max(np.abs(np.diff(np.concatenate(positions)))) * 1000 <= 1.001 * SLOW_M_S
    there = jog(laboratory.wire, laboratory.clock, by_m=-0.002)
    assert there.displacement_m == pytest.approx(0.008, abs=1e-4)


def test_a_movement_against_something_stiff_stops_and_the_rig_has_no_power_afterwards() -> None:
    laboratory = Laboratory(NOTHING._replace(stiffness=4e5))
    with pytest.raises(ProcedureError, match="the rig stands still"):
        jog(laboratory.wire, laboratory.clock, to_m=0.02)
    assert abs(laboratory.rig.controller.measured[0]) < 2000
    assert laboratory.rig.controller.state is RigState.DISABLED


def test_a_place_outside_the_rig_is_refused_before_anything_moves() -> None:
    laboratory = Laboratory(NOTHING)
    with pytest.raises(LimitError, match="outside"):
        jog(laboratory.wire, laboratory.clock, to_m=0.2)
    assert laboratory.rig.controller.measured[1] == pytest.approx(0.0, abs=1e-5)


def test_a_gas_spring_has_no_zero_and_is_removed_with_what_it_carries() -> None:
    laboratory = Laboratory(NOTHING._replace(preload=-300.0, stiffness=800.0))
    with pytest.raises(ProcedureError, match="no zero of the force"):
        mount(laboratory.wire, laboratory.clock, Person(), MountingSettings(reach_m=0.003))
    person = Person()
    here = remove(laboratory.wire, laboratory.clock, person, MountingSettings(reach_m=0.003))
    assert here.force_n == pytest.approx(-300.0, abs=25.0)
    assert f"{here.force_n:.0f} N" in person.asked[-1]
    assert laboratory.rig.controller.state is RigState.DISABLED


def test_without_confirmation_nothing_moves() -> None:
    laboratory = Laboratory(NOTHING)
    with pytest.raises(Declined):
        mount(laboratory.wire, laboratory.clock, Person(yes=False))
    assert laboratory.rig.controller.state in UNPOWERED
    assert not np.any(np.concatenate(laboratory.commands))


def test_whichever_call_the_wire_is_cut_from_the_rig_ends_without_motion() -> None:
    for nth in count(1, 7):
        laboratory = Laboratory(NOTHING._replace(c=500.0))
        wire = CutFrom(laboratory.wire, nth)
        with suppress(RigError):
            jog(wire, laboratory.clock, to_m=0.001)
        for _ in range(400):
            laboratory.clock.sleep(0.01)
            laboratory.rig.tick()
        assert laboratory.rig.controller.state in SAFE_STATES
        if wire.calls < nth:
            return


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        ({"force_n": float("nan")}, "the force is nan N"),
        ({"displacement_m": float("nan")}, "the displacement reads nan m"),
    ],
)
def test_a_sensor_without_a_reading_stops_a_slow_movement(shown: dict[str, float], words: str) -> None:
    laboratory = Laboratory(NOTHING._replace(c=500.0))
    wire = Showing(laboratory.rig, laboratory.clock)
    with powered(wire, laboratory.clock) as station:
        wire.shown = shown
        with pytest.raises(ProcedureError, match=words):
            creep(station, 0.01, limit_n=1e3)
        with pytest.raises(ProcedureError, match=r"reads nan (N|m) at rest"):
            position(station)
        wire.shown = {}
        for nowhere in (float("nan"), float("inf"), 0.2):
            with pytest.raises(LimitError, match="outside"):
                creep(station, nowhere, limit_n=1e3)
    assert np.max(np.abs(np.concatenate(laboratory.commands))) <= 1.1 * STEP_M


class Showing(DirectTransport):
    """A wire that shows other readings than the rig's."""

    shown: dict[str, float] = {}  # noqa: RUF012  # replaced, never changed

    def status(self, deadline_s: float) -> Status:
        return replace(super().status(deadline_s), **self.shown)  # type: ignore[arg-type]  # readings are floats
