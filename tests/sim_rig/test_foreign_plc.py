"""A plain PLC of another make, driven by its map: streamed set-points and its function generator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.axis import Axis
from rigctl.device import PressureStage
from rigctl.errors import (
    Declined,
    LimitError,
    MapError,
    NeedsReset,
    RequestDenied,
    RigFault,
    RigOccupied,
    TransportError,
)
from rigctl.limits import JOG_S, Configuration
from rigctl.machines.rig_map import read_rig_map
from rigctl.operator_acts import reset
from rigctl.player import play
from rigctl.procedures.mounting import jog, mount
from rigctl.procedures.station import commanded
from rigctl.procedures.tare import TareSettings, tare
from rigctl.runfile import read_run
from tests.sim_rig.foreign import (
    EXAMPLES,
    Killed,
    rests_within_its_limits,
    slow_sine,
    worst_departure,
)
from tests.sim_rig.foreign_benches import SCAN, PlcBench
from tests.sim_rig.laboratory import Person


def test_what_is_recorded_is_what_the_sensors_of_the_plc_showed(tmp_path: Path) -> None:
    bench = PlcBench()
    run = bench.play(slow_sine(), tmp_path)
    assert run.status == "complete"
    assert bench.transport.interpolated == 0
    assert worst_departure(run, bench.scanned(), "displacement", 1) <= 2e-9  # single precision of 10 mm
    assert worst_departure(run, bench.scanned(), "force", 0) <= 2e-4
    assert not bench.plc.enabled


def test_the_plc_plays_the_motion_of_the_test_on_its_own_scan(tmp_path: Path) -> None:
    bench = PlcBench()
    test = slow_sine()
    bench.play(test, tmp_path)
    commanded = bench.plant.commanded_m[4:][SCAN - 1 :: SCAN]
    wanted = test.excitation.displacement_m
    at = [np.abs(commanded[k : k + wanted.size] - wanted).max() for k in range(commanded.size - wanted.size)]
    assert min(at) <= 1e-8


@pytest.mark.parametrize("kind", [Kind.SINE, Kind.TRIANGLE])
def test_the_function_generator_plays_a_test_of_whole_cycles(kind: Kind, tmp_path: Path) -> None:
    bench = PlcBench("plc_generator")
    test = slow_sine(kind=kind)
    run = bench.play(test, tmp_path)
    assert run.status == "complete"
    assert worst_departure(run, bench.scanned(), "displacement", 1) <= 2e-9
    commanded = bench.plant.commanded_m[4:][SCAN - 1 :: SCAN]
    wanted = test.excitation.displacement_m
    at = [np.abs(commanded[k : k + wanted.size] - wanted).max() for k in range(commanded.size - wanted.size)]
    assert min(at) <= 1e-7


def test_a_stop_brings_the_piston_to_rest_and_switches_off(tmp_path: Path) -> None:
    bench = PlcBench()
    run = bench.play(
        slow_sine(5.0),
        tmp_path,
        should_stop=lambda: "enough" if bench.plc.scans > 350 and bench.plc.following else None,
    )
    assert run.status == "aborted"
    assert 0 < run.samples < 500
    assert worst_departure(run, bench.scanned(), "displacement", 1) <= 2e-9
    assert not bench.plc.enabled
    bench.time.sleep(2.0)
    assert rests_within_its_limits(bench.plant)


def test_a_test_can_be_held_and_resumed(tmp_path: Path) -> None:
    bench = PlcBench()
    run = bench.play(slow_sine(3.0), tmp_path, should_hold=lambda: 250 < bench.plc.scans < 500)
    assert run.status == "complete"
    assert run.samples == 300
    assert [text for _, text in run.events][1:] == ["hold", "resumed"]
    assert "decelerates within its own limits and switches the drive off" in run.events[0][1]


@pytest.mark.parametrize("example", ["plc_streamed", "plc_generator"])
def test_when_the_host_dies_the_plc_stops_and_nothing_restarts_it(example: str, tmp_path: Path) -> None:
    bench = PlcBench(example)

    def die() -> None:
        if bench.plc.following and bench.plc.scans > 300:
            bench.modem.killed = True

    with pytest.raises(Killed):
        bench.play(slow_sine(5.0), tmp_path, should_stop=die)
    bench.time.sleep(3.0)
    assert bench.plc.fault == 21
    assert not bench.plc.enabled
    assert rests_within_its_limits(bench.plant)
    commanded = bench.plant.commanded_m.size
    another = bench.another_host()
    with pytest.raises(NeedsReset, match="rig reset"):
        play(another, slow_sine(), tmp_path, clock=bench.time)
    assert np.ptp(bench.plant.commanded_m[commanded:]) == 0
    reset(another)
    bench.time.sleep(1.0)
    assert bench.plc.fault == 0
    assert not bench.plc.enabled
    assert np.ptp(bench.plant.commanded_m[commanded:]) == 0


def test_a_controller_that_has_power_belongs_to_somebody_else(tmp_path: Path) -> None:
    bench = PlcBench()
    refused: list[str] = []

    def try_another() -> None:
        if bench.plc.following and not refused:
            with pytest.raises(RigOccupied) as caught:
                play(bench.another_host(), slow_sine(), tmp_path, clock=bench.time)
            refused.append(str(caught.value))

    assert bench.play(slow_sine(3.0), tmp_path, should_stop=try_another).status == "complete"
    assert "another host commands the rig" in refused[0]


def test_an_emergency_stop_ends_the_test_and_stays(tmp_path: Path) -> None:
    bench = PlcBench("plc_streamed", "emergency_stop@1.5:1")
    with pytest.raises(RigFault, match="the emergency stop was pressed") as caught:
        bench.play(slow_sine(5.0), tmp_path)
    assert caught.value.run_path is not None
    assert read_run(caught.value.run_path).status == "aborted"
    bench.time.sleep(5.0)
    assert bench.plc.fault == 1
    assert rests_within_its_limits(bench.plant)


def test_answers_that_are_late_for_longer_than_two_scans_end_the_test_at_rest(tmp_path: Path) -> None:
    bench = PlcBench("plc_streamed", "stalled@2:0.1")
    with pytest.raises(TransportError, match=r"ticks of the controller were missed|no answer|late"):
        bench.play(slow_sine(5.0), tmp_path)
    bench.time.sleep(2.0)
    assert not bench.plc.enabled
    assert rests_within_its_limits(bench.plant)


def test_a_sample_that_was_missed_is_interpolated_and_counted(tmp_path: Path) -> None:
    bench = PlcBench("plc_streamed", "stalled@2:0.022")
    run = bench.play(slow_sine(), tmp_path)
    assert run.status == "complete"
    assert run.samples == 200
    assert 1 <= bench.transport.interpolated <= 2
    assert "missed by this computer and interpolated" in run.events[-1][1]
    assert worst_departure(run, bench.scanned(), "displacement", 1) <= 6.3e-4  # the motion of one scan


def test_a_test_at_another_rate_is_refused_before_anything_moves(tmp_path: Path) -> None:
    bench = PlcBench()
    excitation = slow_sine().excitation
    other = Excitation(
        kind=Kind.SINE,
        sample_rate_hz=200.0,
        period_samples=100,
        displacement_m=excitation.displacement_m,
        current_a=None,
        design={},
    )
    with pytest.raises(LimitError, match="sample_rate is 200 Hz, the rig plays 100 … 100 Hz"):
        bench.play(Test(name="other", excitation=other), tmp_path)
    assert np.ptp(bench.plant.commanded_m) == 0


def test_a_generator_refuses_what_it_cannot_play(tmp_path: Path) -> None:
    bench = PlcBench("plc_generator")
    random = np.random.default_rng(1)
    noise = Excitation(
        kind=Kind.CUSTOM,
        sample_rate_hz=100.0,
        period_samples=0,
        displacement_m=1e-3 * random.standard_normal(200),
        current_a=None,
        design={},
    )
    with pytest.raises(LimitError, match="a function generator plays whole cycles of a sine or a triangle"):
        bench.play(Test(name="noise", excitation=noise), tmp_path)
    assert np.ptp(bench.plant.commanded_m) == 0


def test_the_procedures_before_a_test_work_on_the_plc() -> None:
    bench = PlcBench()
    with commanded(bench.transport, bench.time) as station:
        found = tare(station.axis, bench.time, station.identity, TareSettings(readings=40))
    assert abs(found.offset_n) < 4 * found.uncertainty_n
    assert found.rig.startswith(bench.rig.make)
    here = jog(bench.transport, bench.time, to_m=0.002)
    assert here.displacement_m == pytest.approx(0.002, abs=1e-4)
    assert not bench.plc.enabled


def a_low_plc() -> tuple[PlcBench, Axis]:
    bench = PlcBench()
    axis = Axis(bench.transport, bench.time, stall_s=5.0)
    axis.claim()
    low = bench.rig.low_pressure
    assert low is not None
    axis.prepare(Configuration(sample_rate_hz=100.0, limits=low.within(bench.rig.limits), stage=PressureStage.LOW))
    axis.enable(0.0, 0.0)
    return bench, axis


def test_a_jog_of_the_plc_that_is_not_asked_for_any_more_is_stopped() -> None:
    bench, axis = a_low_plc()
    assert axis.status().stage is PressureStage.LOW
    axis.jog(0.002, lambda: True)
    assert bench.plc.axis.command_m == pytest.approx(0.002, abs=1e-6)
    bench.transport.jog(0.02, 1.0)
    while not axis.status().arrived:
        bench.time.sleep(0.01)
    assert 0.003 < bench.plc.axis.command_m < 0.002 + 0.01 * (JOG_S + 0.1)
    axis.make_safe()


def test_every_positioning_of_the_plc_passes_the_rule_of_the_limits() -> None:
    bench, axis = a_low_plc()
    for place in (0.071, -0.071, float("nan")):
        with pytest.raises(RequestDenied, match=r"displacement leaves -0\.07 … 0\.07"):
            bench.transport.jog(place, 1.0)
    axis.make_safe()
    axis.prepare(Configuration(sample_rate_hz=100.0, limits=replace(bench.rig.limits, position_max_m=0.01)))
    axis.number_next_run()
    axis.enable(0.0, 0.0)
    for place, current, words in ((0.011, 0.0, "displacement"), (0.0, 2.1, "current"), (0.0, float("nan"), "current")):
        with pytest.raises(RequestDenied, match=words):
            bench.transport.direct(place, current, 1.0)
    assert bench.plc.axis.command_m == pytest.approx(0.0, abs=1e-9)
    axis.make_safe()


def test_mounting_says_which_low_pressure_there_is_and_asks_for_it_where_there_is_none() -> None:
    asked = list[str]()
    for example in ("plc_streamed", "plc_generator"):
        bench, person = PlcBench(example), Person(yes=False)
        with pytest.raises(Declined):
            mount(bench.transport, bench.time, person)
        asked.append(person.asked[0])
    assert "low pressure, at most 10 mm/s and 3600 N" in asked[0]
    assert "set the supply to low pressure by hand" in asked[1]


def test_a_map_with_half_a_low_pressure_is_refused() -> None:
    whole = read_rig_map(EXAMPLES / "plc_streamed.toml")
    with pytest.raises(MapError, match="belong together"):
        replace(whole, low_pressure=None)
