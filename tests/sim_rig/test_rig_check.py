"""A rig is walked through: a sound one passes, and each thing that may be wrong is found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from rigctl.device import Fault, RigState
from rigctl.errors import NeedsReset, RigOccupied
from rigctl.limits import Configuration
from rigctl.rig_check import Protocol, Verdict, check_at_rest, check_in_motion
from rigctl.rig_check.page import file_name, protocol_page
from rigctl.transport import Status
from sim_rig.direct import DirectTransport
from tests.sim_rig.virtual import LivingClock, wire_to


def walked(bench: Any, wire: Any | None = None) -> Protocol:
    clock = LivingClock(bench.rig, bench.clock)
    first = wire or DirectTransport(bench.rig, bench.clock)
    return check_at_rest(first, lambda: DirectTransport(bench.rig, bench.clock), clock, operator="A. <Muster>")


def bad(protocol: Protocol) -> list[str]:
    return [one.what for one in protocol.findings if one.verdict is Verdict.BAD]


@pytest.mark.parametrize("wire", ["direct", "modbus", "can", "can_fd"])
def test_a_sound_rig_passes_without_moving(bench: Callable[..., Any], wire: str) -> None:
    b = bench(speed=1.0)
    clock = LivingClock(b.rig, b.clock)
    protocol = check_at_rest(wire_to(wire, b.rig, b.clock), lambda: wire_to(wire, b.rig, b.clock), clock)
    assert bad(protocol) == []
    assert {one.part for one in protocol.findings} == {
        "identity", "limits", "state", "wire", "clocks", "one master", "refusals", "stop",
    }  # fmt: skip
    assert abs(b.plant.travelled_m).max() < 1e-4
    assert b.rig.controller.state is RigState.DISABLED


def test_with_a_millimetre_it_moves_comes_back_stops_and_its_watchdog_acts(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    clock = LivingClock(b.rig, b.clock)
    found = check_in_motion(DirectTransport(b.rig, b.clock), clock)
    assert found[0].found == "low: 10 mm/s, 2500 N"
    assert [one.found for one in found[1:] if one.verdict is not Verdict.GOOD] == []
    assert [one.what[:20] for one in found[1:]] == [
        "moves by 1 mm",
        "comes back",
        "a stop while it move",
        "the host is silent f",
    ]
    assert 0.9e-3 < abs(b.plant.travelled_m).max() < 1.3e-3
    assert b.rig.controller.faults == Fault.HEARTBEAT
    with pytest.raises(NeedsReset):
        walked(b)


class Careless(DirectTransport):
    """A wire to a rig that says yes to every configuration."""

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        pass


class Hanging(DirectTransport):
    """A wire to a rig whose controller does not count heartbeats, and whose clock is 2 % fast."""

    def status(self, deadline_s: float) -> Status:
        found = super().status(deadline_s)
        return replace(found, heartbeat=7, sample_index=round(1.02 * found.sample_index))


def test_a_rig_that_accepts_everything_and_one_whose_clock_is_wrong_are_found(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    found = bad(walked(b, Careless(b.rig, b.clock)))
    assert found == ["limits wider than the machine's", "a sample rate above its own", "a watchdog of a minute"]
    b = bench(speed=1.0)
    wrong = bad(walked(b, Hanging(b.rig, b.clock)))
    assert wrong == ["heartbeat of the rig", "sample clock at 1000 Hz against this computer's"]


def test_a_rig_that_somebody_commands_is_refused(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    DirectTransport(b.rig, b.clock).claim(1.0)
    with pytest.raises(RigOccupied):
        walked(b)


def test_the_page_has_every_finding_opens_offline_and_names_what_must_be_done_by_hand(
    bench: Callable[..., Any],
) -> None:
    protocol = walked(bench(speed=1.0))
    page = protocol_page(protocol)
    assert "Nothing wrong was found" in page
    assert all(one.found.replace("'", "&#x27;").replace("<", "&lt;") in page for one in protocol.findings)
    assert "A. &lt;Muster&gt;" in page
    assert "http" not in page.replace("http-equiv", "")
    assert "Emergency stop pressed under power" in page
    assert file_name(protocol).startswith("rig-check-sim_rig-1-")
    wrong = replace(protocol.findings[0], verdict=Verdict.BAD)
    assert "1 finding is bad" in protocol_page(protocol.with_findings((wrong,)))
