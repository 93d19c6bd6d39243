"""A motion controller of another make with a trajectory buffer, driven by its map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.errors import RigFault, TransportError
from rigctl.runfile import read_run
from tests.sim_rig.foreign import (
    Killed,
    rests_within_its_limits,
    worst_departure,
)
from tests.sim_rig.foreign_benches import MotionBench


def a_test(seconds: float = 1.0) -> Test:
    time = np.arange(round(seconds * 1000)) / 1000
    return Test(
        name="a test",
        excitation=Excitation(
            kind=Kind.CUSTOM,
            sample_rate_hz=1000.0,
            period_samples=0,
            displacement_m=0.01 * np.sin(2 * np.pi * 2 * time) + 0.002 * np.sin(2 * np.pi * 7 * time),
            current_a=0.5 + 0.2 * np.sin(2 * np.pi * 3 * time),
            design={},
        ),
    )


def test_what_is_recorded_is_what_the_sensors_of_the_controller_showed(tmp_path: Path) -> None:
    bench = MotionBench()
    run = bench.play(a_test(3.0), tmp_path)
    assert run.status == "complete"
    assert run.samples == 3000
    assert worst_departure(run, bench.plant.measured, "displacement", 1) <= 1e-9
    assert worst_departure(run, bench.plant.measured, "force", 0) <= 1e-9
    assert worst_departure(run, bench.plant.measured, "current", 2) <= 1e-9
    assert not bench.controller.powered


def test_the_controller_plays_the_motion_of_the_test_on_its_own_clock(tmp_path: Path) -> None:
    bench = MotionBench()
    wanted = a_test().excitation.displacement_m
    bench.play(a_test(), tmp_path)
    commanded = bench.plant.commanded_m
    at = [np.abs(commanded[k : k + wanted.size] - wanted).max() for k in range(commanded.size - wanted.size)]
    assert min(at) <= 0.51e-7  # half a count


def test_a_stop_brings_the_piston_to_rest_and_empties_the_buffer(tmp_path: Path) -> None:
    bench = MotionBench()
    run = bench.play(
        a_test(5.0), tmp_path, should_stop=lambda: "enough" if bench.plant.commanded_m.size > 2500 else None
    )
    assert run.status == "aborted"
    assert not bench.controller.powered
    bench.time.sleep(1.0)
    assert rests_within_its_limits(bench.plant)


def test_a_test_can_be_held_and_resumed(tmp_path: Path) -> None:
    bench = MotionBench()
    run = bench.play(a_test(2.0), tmp_path, should_hold=lambda: 1500 < bench.controller.cycles < 2500)
    assert run.status == "complete"
    assert run.samples == 2000


def test_when_the_host_dies_the_controller_stops_and_nothing_restarts_it(tmp_path: Path) -> None:
    bench = MotionBench()

    def die() -> None:
        if bench.controller.running and bench.controller.cycles > 1500:
            bench.modem.killed = True

    with pytest.raises(Killed):
        bench.play(a_test(5.0), tmp_path, should_stop=die)
    bench.time.sleep(3.0)
    assert bench.controller.error == 9
    assert not bench.controller.powered
    assert rests_within_its_limits(bench.plant)


def test_an_emergency_stop_ends_the_test_and_stays(tmp_path: Path) -> None:
    bench = MotionBench("emergency_stop@1:1")
    with pytest.raises(RigFault, match="the emergency stop was pressed") as caught:
        bench.play(a_test(5.0), tmp_path)
    assert caught.value.run_path is not None
    run = read_run(caught.value.run_path)
    assert run.status == "aborted"
    assert run.samples > 500
    bench.time.sleep(5.0)
    assert bench.controller.error == 1
    assert rests_within_its_limits(bench.plant)


def test_answers_that_are_late_while_the_buffer_lasts_cost_nothing(tmp_path: Path) -> None:
    bench = MotionBench("stalled@1:0.2")
    run = bench.play(a_test(3.0), tmp_path)
    assert run.status == "complete"
    assert worst_departure(run, bench.plant.measured, "displacement", 1) <= 1e-9


def test_answers_that_are_late_for_longer_than_the_watchdog_end_the_test_at_rest(tmp_path: Path) -> None:
    bench = MotionBench("stalled@1:0.8")
    with pytest.raises((RigFault, TransportError)):
        bench.play(a_test(5.0), tmp_path)
    bench.time.sleep(1.0)
    assert bench.controller.error == 9
    assert rests_within_its_limits(bench.plant)
