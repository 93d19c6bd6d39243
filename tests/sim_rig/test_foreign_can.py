"""A PLC on CAN, driven by its DBC file or by the places of its signals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from rigctl.errors import MapError, RigFault, TransportError
from rigctl.machines.can_points import CanPoints
from rigctl.machines.rig_map import read_rig_map
from rigctl.machines.roles import Role
from rigctl.machines.wires import Signal
from sim_rig.foreign.plc import Plc
from sim_rig.foreign.plc_can import PlcOnCan
from tests.sim_rig.foreign import (
    EXAMPLES,
    Killed,
    NodeBus,
    Time,
    faults_and_plant,
    rests_within_its_limits,
    worst_departure,
)
from tests.sim_rig.foreign_benches import SCAN, CanBench


def test_what_is_recorded_is_what_the_sensors_of_the_plc_showed(tmp_path: Path) -> None:
    bench = CanBench()
    run = bench.play(tmp_path)
    assert run.status == "complete"
    assert bench.transport.interpolated == 0
    assert worst_departure(run, bench.plant.measured[4:][SCAN - 1 :: SCAN], "displacement", 1) <= 1e-9
    assert worst_departure(run, bench.plant.measured[4:][SCAN - 1 :: SCAN], "force", 0) <= 1e-9


def test_signals_may_be_described_in_the_map_itself(tmp_path: Path) -> None:
    rig = read_rig_map(EXAMPLES / "plc_can.toml")
    assert rig.can is not None
    own = {
        Role.POSITION: Signal(role=Role.POSITION, id=0x182, start_bit=0, bits=32, signed=True, scale=1e-7),
        Role.FORCE: Signal(role=Role.FORCE, id=0x182, start_bit=32, bits=32, signed=True, scale=0.1),
    }
    bench = CanBench(rig=replace(rig, signal=tuple(own.get(one.role, one) for one in rig.signal)))
    run = bench.play(tmp_path, 1.0)
    assert worst_departure(run, bench.plant.measured[4:][SCAN - 1 :: SCAN], "displacement", 1) <= 1e-9


def test_frames_that_come_late_and_together_are_all_recorded(tmp_path: Path) -> None:
    bench = CanBench("stalled@2:0.018")
    run = bench.play(tmp_path)
    assert run.status == "complete"
    assert run.samples == 200


def test_when_the_host_dies_the_plc_stops(tmp_path: Path) -> None:
    bench = CanBench()

    def die() -> None:
        bench.bus.killed = bench.bus.killed or (bench.plc.following and bench.plc.scans > 300)

    with pytest.raises(Killed):
        bench.play(tmp_path, 5.0, should_stop=die)
    bench.time.sleep(2.0)
    assert bench.plc.fault == 21
    assert rests_within_its_limits(bench.plant)


def test_a_bus_on_which_nothing_comes_any_more_ends_the_test_at_rest(tmp_path: Path) -> None:
    bench = CanBench("stalled@2:3")
    with pytest.raises((TransportError, RigFault)):
        bench.play(tmp_path, 5.0)
    bench.time.sleep(5.0)
    assert not bench.plc.enabled
    assert rests_within_its_limits(bench.plant)


@pytest.mark.parametrize(
    ("was", "becomes", "says"),
    [
        ('signal = "Halt"', 'signal = "Hold"', "signal stop: Command has no signal 'Hold': it has CoilCommand, Enable"),
        ('message = "Motion"', 'message = "Move"', "has no message 'Move': it has Command, Measured, Motion, State"),
        ('message = "State"\nsignal = "Moving"', 'message = "Command"\nsignal = "Follow"', "one side sends a frame"),
        ('dbc = "plc_can.dbc"', 'dbc = "plc.dbc"', "plc.dbc: cannot be read as a DBC file"),
        ("bitrate = 500000", "bitrate = 5", "bitrate is 5: it must lie in 1 000 … 12 000 000 bit/s"),
        ("# sample_point", "sample_point", "sample_point and clock belong together"),
    ],
)
def test_a_map_that_does_not_fit_its_dbc_file_is_refused_in_one_line(
    was: str, becomes: str, says: str, tmp_path: Path
) -> None:
    text = (EXAMPLES / "plc_can.toml").read_text(encoding="utf-8")
    assert was in text
    (tmp_path / "plc_can.dbc").write_bytes((EXAMPLES / "plc_can.dbc").read_bytes())
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(was, becomes, 1), encoding="utf-8")
    with pytest.raises(MapError) as caught:
        read_rig_map(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_offset_moves_every_identifier_of_the_file() -> None:
    rig = read_rig_map(EXAMPLES / "plc_can.toml")
    assert rig.can is not None
    time = Time()
    _, _, played = faults_and_plant((), time)
    bus = NodeBus(PlcOnCan(Plc(played, now=time.now)), time)
    moved = replace(rig.can, id_offset=0x10)
    points = CanPoints("can://virtual", moved, rig.signal, lambda: bus, time)
    with pytest.raises(TransportError, match="no frames with"):
        points.read([Role.POSITION], time.now() + 0.25)
