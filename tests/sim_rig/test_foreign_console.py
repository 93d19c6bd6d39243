"""A console of another make that is driven by files and flags."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.errors import RigFault, TransportError
from tests.sim_rig.foreign import Killed, rests_within_its_limits, worst_departure
from tests.sim_rig.foreign_benches import ConsoleBench


def a_test(seconds: float = 1.0) -> Test:
    time = np.arange(round(seconds * 500)) / 500
    return Test(
        name="a test",
        excitation=Excitation(
            kind=Kind.CUSTOM,
            sample_rate_hz=500.0,
            period_samples=0,
            displacement_m=0.01 * np.sin(2 * np.pi * 2 * time),
            current_a=0.5 + 0.2 * np.sin(2 * np.pi * 3 * time),
            design={},
        ),
    )


def test_what_is_recorded_is_what_the_sensors_of_the_console_showed(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)
    run = bench.play(a_test(), tmp_path)
    assert run.status == "complete"
    assert run.samples == 500
    departures = [worst_departure(run, bench.plant.measured[k::2], "displacement", 1) for k in (0, 1)]
    assert min(departures) <= 2e-9  # single precision of 10 mm
    assert not bench.console.on


def test_the_console_plays_the_drive_file_to_its_resolution(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)
    wanted = a_test().excitation.displacement_m
    bench.play(a_test(), tmp_path)
    found = []
    for k in (0, 1):
        commanded = bench.plant.commanded_m[k::2]
        found += [np.abs(commanded[n : n + wanted.size] - wanted).max() for n in range(commanded.size - wanted.size)]
    assert min(found) <= 0.01 / 32767  # 16 bits over the peak


def test_a_stop_brings_the_piston_to_rest_and_keeps_what_was_played(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)
    run = bench.play(
        a_test(5.0), tmp_path, should_stop=lambda: "enough" if bench.plant.commanded_m.size > 2500 else None
    )
    assert run.status == "aborted"
    assert 300 < run.samples < 2500
    assert not bench.console.on
    bench.time.sleep(1.0)
    assert rests_within_its_limits(bench.plant)


def test_a_test_can_be_held_and_resumed(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)
    run = bench.play(a_test(2.0), tmp_path, should_hold=lambda: 1500 < bench.console.steps < 2500)
    assert run.status == "complete"
    assert run.samples == 1000


def test_when_the_host_dies_the_console_stops_and_nothing_restarts_it(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)

    def die() -> None:
        bench.killed = bench.killed or (bench.console.playing and bench.console.steps > 1500)

    with pytest.raises(Killed):
        bench.play(a_test(5.0), tmp_path, should_stop=die)
    bench.time.sleep(3.0)
    assert bench.console.fault == 7
    assert not bench.console.on
    assert rests_within_its_limits(bench.plant)


def test_an_emergency_stop_ends_the_test_and_stays(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path, "emergency_stop@1:1")
    with pytest.raises(RigFault, match="the emergency stop was pressed"):
        bench.play(a_test(5.0), tmp_path)
    bench.time.sleep(5.0)
    assert bench.console.fault == 1
    assert rests_within_its_limits(bench.plant)


def test_a_console_that_looks_late_at_its_folder_is_waited_for(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path, "stalled@1:0.4")
    assert bench.play(a_test(2.0), tmp_path).status == "complete"


def test_a_folder_without_a_console_is_one_line(tmp_path: Path) -> None:
    bench = ConsoleBench(tmp_path)
    (tmp_path / "console" / "status.txt").unlink()
    with pytest.raises(TransportError, match=r"no status.txt: the console does not run, or not in this folder"):
        bench.transport.identify(0.25)
