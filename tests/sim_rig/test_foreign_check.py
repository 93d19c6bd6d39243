"""Controllers of other makes are walked through as far as their maps allow; what is not known is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from rigctl.errors import RigOccupied
from rigctl.machines.transport import MachineTransport
from rigctl.procedures.station import powered
from rigctl.rig_check import Finding, Verdict, check_at_rest, check_in_motion
from rigctl.rig_check.page import protocol_page
from tests.sim_rig.foreign import WatchedPlant
from tests.sim_rig.foreign_benches import CanBench, ConsoleBench, DriveBench, MotionBench, PlcBench

BENCHES: dict[str, Callable[[Path], PlcBench | MotionBench | CanBench | DriveBench | ConsoleBench]] = {
    "plc_streamed": lambda folder: PlcBench(),
    "plc_generator": lambda folder: PlcBench("plc_generator"),
    "plc_can": lambda folder: CanBench(),
    "motion_buffered": lambda folder: MotionBench(),
    "ds402": lambda folder: DriveBench(),
    "console_file": ConsoleBench,
}


def nobody_else() -> MachineTransport:
    raise AssertionError("a second host is not needed without power")


def found_in(findings: tuple[Finding, ...], what: str) -> Finding:
    return next(one for one in findings if one.what.startswith(what))


def travelled_m(plant: WatchedPlant) -> float:
    shown = plant.measured[:, 1]
    return float(shown.max() - shown.min())


@pytest.mark.parametrize("name", BENCHES)
def test_a_foreign_controller_passes_without_moving_and_what_is_not_known_is_said(name: str, tmp_path: Path) -> None:
    bench = BENCHES[name](tmp_path)
    protocol = check_at_rest(bench.transport, nobody_else, bench.time)
    assert [one for one in protocol.findings if one.verdict is Verdict.BAD] == []
    assert travelled_m(bench.plant) < 1e-4
    assert bench.transport.session == 0
    told = {one.what: one.found for one in protocol.findings}
    assert told["watchdog, by its map"].startswith("when this computer is silent for ")
    assert told["FIFO, capture store"].startswith("not known")
    assert told["wrong configurations"].startswith("not known")
    assert told["a second host wants to command"].startswith("not known")
    assert "ppm" in found_in(protocol.findings, "sample clock at").found
    assert "by its map" in protocol_page(protocol)


@pytest.mark.parametrize("name", BENCHES)
def test_with_a_millimetre_a_foreign_controller_moves_stops_and_its_watchdog_acts(name: str, tmp_path: Path) -> None:
    bench = BENCHES[name](tmp_path)
    found = check_in_motion(bench.transport, bench.time)
    assert [one.found for one in found[1:] if one.verdict is not Verdict.GOOD] == []
    assert [one.what[:13] for one in found] == [
        "pressure",
        "moves by 1 mm",
        "comes back",
        "a stop while ",
        "the host is s",
    ]
    assert 0.9e-3 < travelled_m(bench.plant) < 1.3e-3
    assert "heartbeat was lost" in found[-1].found
    low = bench.transport.identify(1.0).low_pressure
    assert found[0].found.startswith("full" if low is None else "low: 10 mm/s")


def test_under_power_a_second_host_of_a_foreign_controller_is_refused() -> None:
    bench = PlcBench()
    found = check_in_motion(bench.transport, bench.time, another=bench.another_host, watchdog=False)
    assert found_in(found, "a second host").found == "refused; it may read"
    with powered(bench.transport, bench.time), pytest.raises(RigOccupied):
        check_at_rest(bench.another_host(), nobody_else, bench.time)


def test_a_foreign_controller_whose_clock_or_watchdog_is_not_as_its_map_says_is_found() -> None:
    bench = PlcBench()
    mapped = replace(bench.rig, clock=replace(bench.rig.clock, rate_hz=98.0))
    bench.transport = MachineTransport(mapped, bench.transport._machine, clock=bench.time)
    protocol = check_at_rest(bench.transport, nobody_else, bench.time)
    assert [one.what[:12] for one in protocol.findings if one.verdict is Verdict.BAD] == ["sample clock"]

    bench = PlcBench()
    hasty = replace(bench.rig, watchdog=replace(bench.rig.watchdog, time_s=0.1))
    bench.transport = MachineTransport(hasty, bench.transport._machine, clock=bench.time)
    assert check_in_motion(bench.transport, bench.time)[-1].verdict is Verdict.BAD
