"""A CANopen drive of another make, driven by its EDS file in interpolated position mode."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.device import PressureStage
from rigctl.errors import MapError, RigFault, TransportError
from rigctl.machines.can_bus import bus_arguments
from rigctl.machines.rig_map import read_rig_map
from rigctl.machines.wires import Bus
from sim_rig.foreign.ds402 import DISABLED, FAULT, HEARTBEAT
from tests.sim_rig.foreign import (
    EXAMPLES,
    Killed,
    rests_within_its_limits,
    worst_departure,
)
from tests.sim_rig.foreign_benches import PERIOD, DriveBench


def a_test(seconds: float = 2.0) -> Test:
    time = np.arange(round(seconds * 100)) / 100
    return Test(
        name="a test",
        excitation=Excitation(
            kind=Kind.CUSTOM,
            sample_rate_hz=100.0,
            period_samples=0,
            displacement_m=0.01 * np.sin(2 * np.pi * 1.5 * time),
            current_a=0.5 + 0.2 * np.sin(2 * np.pi * time),
            design={},
        ),
    )


def test_what_is_recorded_is_what_the_sensors_of_the_drive_showed(tmp_path: Path) -> None:
    bench = DriveBench()
    run = bench.play(a_test(), tmp_path)
    assert run.status == "complete"
    assert worst_departure(run, bench.periods(), "displacement", 1) <= 1e-9
    assert worst_departure(run, bench.periods(), "force", 0) <= 0.5  # the drive reports whole newtons
    assert bench.drive.state == DISABLED


def test_the_drive_plays_the_motion_of_the_test_on_its_own_clock(tmp_path: Path) -> None:
    bench = DriveBench()
    wanted = a_test().excitation.displacement_m
    bench.play(a_test(), tmp_path)
    commanded = bench.plant.commanded_m[4:][PERIOD - 1 :: PERIOD]
    at = [np.abs(commanded[k : k + wanted.size] - wanted).max() for k in range(commanded.size - wanted.size)]
    assert min(at) <= 0.51e-7  # half a count


def test_a_stop_brings_the_piston_to_rest_and_switches_off(tmp_path: Path) -> None:
    bench = DriveBench()
    run = bench.play(
        a_test(5.0), tmp_path, should_stop=lambda: "enough" if bench.plant.commanded_m.size > 2500 else None
    )
    assert run.status == "aborted"
    assert run.samples > 50
    assert bench.drive.state == DISABLED
    bench.time.sleep(1.0)
    assert rests_within_its_limits(bench.plant)


def test_a_test_can_be_held_and_resumed(tmp_path: Path) -> None:
    bench = DriveBench()
    run = bench.play(a_test(3.0), tmp_path, should_hold=lambda: 2000 < bench.drive.steps < 3500)
    assert run.status == "complete"
    assert run.samples == 300


def test_when_the_host_dies_the_drive_stops_and_nothing_restarts_it(tmp_path: Path) -> None:
    bench = DriveBench()

    def die() -> None:
        bench.bus.killed = bench.bus.killed or (bench.drive.interpolating and bench.drive.steps > 2000)

    with pytest.raises(Killed):
        bench.play(a_test(5.0), tmp_path, should_stop=die)
    bench.time.sleep(3.0)
    assert bench.drive.state == FAULT
    assert rests_within_its_limits(bench.plant)


def test_a_heartbeat_that_stops_is_an_error_of_the_drive(tmp_path: Path) -> None:
    """The buffer alone would last for 0.3 s; at rest under power only the heartbeat tells of the host."""
    bench = DriveBench()
    bench.transport.identify(0.25)
    bench.machine.configure(read_rig_map(EXAMPLES / "ds402.toml").limits, PressureStage.HIGH, bench.time.now() + 0.25)
    bench.machine.enable(bench.time.now() + 0.25)
    bench.time.sleep(1.0)
    assert bench.drive.error == HEARTBEAT


def test_an_emergency_stop_ends_the_test_and_stays(tmp_path: Path) -> None:
    bench = DriveBench("emergency_stop@1:1")
    with pytest.raises(RigFault, match="the emergency stop was pressed"):
        bench.play(a_test(5.0), tmp_path)
    bench.time.sleep(5.0)
    assert bench.drive.state == FAULT
    assert rests_within_its_limits(bench.plant)


def test_late_frames_cost_nothing_while_the_buffer_of_the_drive_lasts(tmp_path: Path) -> None:
    bench = DriveBench("stalled@1:0.15")
    run = bench.play(a_test(3.0), tmp_path)
    assert run.status == "complete"
    assert worst_departure(run, bench.periods(), "displacement", 1) <= 1e-9


def test_a_bus_that_is_dead_for_longer_than_the_buffer_ends_the_test_at_rest(tmp_path: Path) -> None:
    bench = DriveBench("stalled@1:1.5")
    with pytest.raises((RigFault, TransportError)):
        bench.play(a_test(5.0), tmp_path)
    bench.time.sleep(2.0)
    assert bench.drive.state in (FAULT, DISABLED)
    assert rests_within_its_limits(bench.plant)


def test_a_lost_frame_of_measured_values_ends_the_test_at_rest(tmp_path: Path) -> None:
    bench = DriveBench()
    lost = [0]

    def lose(identifier: int) -> bool:
        due = identifier == 0x285 and bench.drive.interpolating and bench.drive.steps > 2000 and not lost[0]
        lost[0] += due
        return due

    bench.bus.lose = lose
    with pytest.raises(TransportError, match="1 frames of measured values were lost"):
        bench.play(a_test(5.0), tmp_path)
    bench.time.sleep(1.0)
    assert rests_within_its_limits(bench.plant)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: text.replace("[6040]", "[6042]").replace("=0x6040", "=0x6042"), "object 6040:00 is missing"),
        (lambda text: text.replace("0x60410010", "0x60410020"), "PDO 1 maps 6041:00 with 32 bits"),
        (lambda text: text.replace("0x20410010", "0x20400010"), "2041:00, 2042:00, 6064:00 must lie in one TPDO"),
        (
            lambda text: text.replace("=Force\n", "=Strength\n"),
            "force_object is 'Force': .* has no object of this name",
        ),
        (
            lambda text: text[: text.index("[OptionalObjects]")].replace("=0x7", "=seven"),
            "cannot be read as an EDS file",
        ),
    ],
)
def test_an_eds_file_that_does_not_fit_is_refused_in_one_line(
    change: Callable[[str], str], says: str, tmp_path: Path
) -> None:
    text = (EXAMPLES / "ds402.eds").read_text(encoding="ascii")
    assert change(text) != text
    (tmp_path / "ds402.eds").write_text(change(text), encoding="ascii")
    path = tmp_path / "rig.toml"
    path.write_text((EXAMPLES / "ds402.toml").read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(MapError, match=says) as caught:
        read_rig_map(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("bus", "wanted"),
    [
        (Bus(interface="socketcan", channel="can0"), {"interface": "socketcan", "channel": "can0", "fd": False}),
        (Bus(interface="kvaser", channel="1", bitrate=250_000), {"channel": 1, "bitrate": 250_000}),
        (Bus(interface="vector", channel="0", app_name="rig", sjw=2), {"channel": 0, "app_name": "rig", "sjw": 2}),
        (Bus(interface="pcan", channel="PCAN_USBBUS1", fd=True), {"fd": True, "data_bitrate": 2_000_000}),
    ],
)
def test_every_interface_gets_the_arguments_that_it_knows(bus: Bus, wanted: dict[str, Any]) -> None:
    assert wanted.items() <= bus_arguments(bus).items()


def test_the_bit_timing_has_the_sample_point_that_the_map_asks_for() -> None:
    bus = Bus(interface="pcan", channel="PCAN_USBBUS1", bitrate=500_000, sample_point=0.875, clock_hz=8_000_000)
    timing = bus_arguments(bus)["timing"]
    assert timing.bitrate == 500_000
    assert timing.sample_point == pytest.approx(87.5)


def test_a_bit_timing_that_is_set_elsewhere_or_does_not_exist_is_refused() -> None:
    with pytest.raises(MapError, match="ip link set"):
        bus_arguments(Bus(interface="socketcan", channel="can0", sample_point=0.8, clock_hz=8_000_000))
    with pytest.raises(MapError, match="bitrate 500000 at a clock of 1000001 Hz"):
        bus_arguments(Bus(interface="pcan", channel="x", sample_point=0.8, clock_hz=1_000_001))
    with pytest.raises(MapError, match="interface is 'telepathy'"):
        bus_arguments(Bus(interface="telepathy", channel="x"))
