"""Late hosts, small FIFOs, other hosts: the stream loses nothing, or the error says why it cannot go on."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl import can_frames as frames
from rigctl.axis import POLL_S, STATE_S, STOP_S, Axis
from rigctl.device import Control, Fault, RigState
from rigctl.errors import NeedsReset, RigOccupied
from rigctl.limits import Configuration
from rigctl.operator_acts import reset
from rigctl.player import PlayerSettings, play
from rigctl.priority import drop_priority, real_time_priority
from rigctl.progress import Phase, Progress
from rigctl.runfile import read_run
from rigctl.session import NUMBERS, WINDOW, Session
from sim_rig.can_server import CanDevice
from sim_rig.direct import DirectTransport
from sim_rig.errors import RequestRefused
from sim_rig.master import Master
from tests.sim_rig.virtual import WIRES, Killable, Killed, LivingClock, wire_to

QUICK = PlayerSettings(ramp_s=0.1)


def at_5_khz(seconds: float) -> Test:
    t = np.arange(round(5000 * seconds)) / 5000
    excitation = Excitation(
        kind=Kind.SINE,
        sample_rate_hz=5000.0,
        period_samples=1000,
        displacement_m=0.01 * np.sin(2 * np.pi * 5 * t),
        current_a=np.full(t.size, 0.8),
    )
    return Test(name="fast", excitation=excitation)


def test_a_host_that_is_late_repeatedly_loses_nothing_at_5_khz(bench: Callable[..., Any], tmp_path: Path) -> None:
    b, late = bench(speed=1.0), list[float]()

    def sleep(progress: Progress) -> None:
        if progress.phase is Phase.RUNNING:
            late.append(b.clock.now())
            b.wait(0.9)  # the watchdog waits 1 s

    test = at_5_khz(2.0)
    settings = PlayerSettings(ramp_s=0.2, report_s=0.3)
    wire = wire_to("can_fd", b.rig, b.clock)
    run = read_run(play(wire, test, tmp_path, clock=b.clock, settings=settings, on_progress=sleep))
    assert (run.status, run.samples) == ("complete", test.excitation.samples)
    assert len(late) > 2
    status = b.rig.status()
    assert (status.underruns, status.gaps) == (0, 0)


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("fifo_samples", [64, 700])
def test_a_rig_with_a_small_fifo_gets_blocks_that_fit_it(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, wire: str, fifo_samples: int
) -> None:
    b = bench(speed=20.0, fifo_samples=fifo_samples)
    transport = wire_to(wire, b.rig, b.clock)
    assert transport.identify(1.0).fifo_samples == fifo_samples
    test = replace(a_sine(600), name="small")
    run = read_run(play(transport, test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.1)))
    assert (run.status, run.samples) == ("complete", 600)
    assert np.max(np.abs(run.channels["displacement"] - test.excitation.displacement_m)) < 2e-3
    assert b.rig.status().gaps == 0


def test_real_time_priority_ends_with_its_block_and_is_not_inherited_by_threads_that_drop_it() -> None:
    before, inside = _policy(), list[int]()
    with real_time_priority() as permitted:
        during = _policy()
        thread = threading.Thread(target=lambda: (drop_priority(), inside.append(_policy())))
        thread.start()
        thread.join()
    assert inside == [before]
    assert _policy() == before
    assert (during != before) is permitted


def _policy() -> int:
    return os.sched_getscheduler(0) if hasattr(os, "sched_getscheduler") else 0


@pytest.mark.parametrize(("phase", "speed"), [(Phase.RUNNING, 20.0), (Phase.HOLD, 1.0)])
def test_a_rig_that_another_host_has_under_power_is_refused(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, phase: Phase, speed: float
) -> None:
    b, refusals, seen = bench(speed=speed), list[str](), list[Phase]()
    first, second = DirectTransport(b.rig, b.clock), DirectTransport(b.rig, Elsewhere(b))

    def intrude(progress: Progress) -> None:
        seen.append(progress.phase)
        if progress.phase is phase and not refusals:
            refusals.append("")
            with pytest.raises(RigOccupied, match="another host commands the rig") as caught:
                play(second, a_sine(100), tmp_path / "second", clock=Elsewhere(b), settings=QUICK)
            refusals.append(str(caught.value))

    run = read_run(
        play(
            first,
            a_sine(12_000),
            tmp_path / "first",
            clock=b.clock,
            settings=replace(QUICK, report_s=0.0),
            on_progress=intrude,
            should_hold=lambda: phase is Phase.HOLD and Phase.RUNNING in seen and seen.count(Phase.HOLD) < 9,
        )
    )
    assert (run.status, run.samples) == ("complete", 12_000)
    assert len(refusals) == 2
    assert not (tmp_path / "second").exists()


class Elsewhere:
    """The clock of a second host: while it sleeps the first one talks to the rig."""

    def __init__(self, bench: Any) -> None:
        self._bench = bench

    def now(self) -> float:
        return float(self._bench.clock.now())

    def sleep(self, seconds: float) -> None:
        for _ in range(max(round(seconds / 0.1), 1)):
            self._bench.clock.sleep(min(seconds, 0.1))
            self._bench.rig.tick()


@pytest.mark.parametrize("wire", WIRES)
def test_a_host_that_has_lost_a_rig_without_power_does_not_stop_the_next_one(
    bench: Callable[..., Any], wire: str
) -> None:
    b = bench(speed=1.0)
    asleep, awake = (Axis(wire_to(wire, b.rig, b.clock), b.clock, stall_s=5.0) for _ in range(2))
    for axis in (asleep, awake):
        axis.identify()
        axis.claim()
        axis.prepare(Configuration(heartbeat_s=5.0))
        b.wait(1.5)  # the host does not run: its session is over
    awake.status()
    awake.enable(0.01, 0.0)
    asleep.make_safe()
    assert b.rig.controller.state is RigState.HOLD
    awake.travel(0.02, 0.0)
    awake.make_safe()
    assert b.rig.controller.state is RigState.DISABLED


def test_a_host_that_died_leaves_a_rig_that_waits_for_an_operator(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    wire = DirectTransport(b.rig, b.clock)
    host = Killable(wire)

    def die(progress: Progress) -> None:
        if progress.samples > 500:
            host.killed = True
            raise Killed

    with pytest.raises(Killed):
        play(host, a_sine(9000), tmp_path / "dead", clock=b.clock, settings=QUICK, on_progress=die)
    assert b.rig.controller.state is RigState.ACTIVE
    following = DirectTransport(b.rig, b.clock)
    with pytest.raises(RigOccupied):
        play(following, a_sine(300), tmp_path, clock=b.clock, settings=QUICK)
    b.wait(2.0)
    with pytest.raises(NeedsReset, match="heartbeat was lost"):
        play(following, a_sine(300), tmp_path, clock=b.clock, settings=QUICK)
    reset(following, b.clock)
    run = read_run(play(following, a_sine(300), tmp_path, clock=LivingClock(b.rig, b.clock), settings=QUICK))
    assert run.status == "complete"


def test_the_masters_new_heartbeats_feed_the_watchdog_and_nothing_else_does(bench: Callable[..., Any]) -> None:
    beat = frames.pack_host_heartbeat
    for heartbeats, state in (
        (lambda own, k: (frames.HOST_HEARTBEAT, beat(own, k + 1)), RigState.HOLD),
        (lambda own, k: (frames.HOST_HEARTBEAT, beat(own, 1)), RigState.FAULT_HOLD),  # the same one again and again
        (lambda own, k: (frames.HOST_HEARTBEAT, beat(own + 1, k + 1)), RigState.FAULT_HOLD),
        (lambda own, k: (frames.HOST_HEARTBEAT, beat(0, k + 1)), RigState.FAULT_HOLD),
        (lambda own, k: (0x123, bytes(8)), RigState.FAULT_HOLD),
    ):
        b = bench(speed=1.0)
        device = CanDevice(b.rig, b.clock.now, fd=False)
        b.command(Control.HOLD)
        for k in range(30):
            b.wait(0.1)
            device.take(*heartbeats(b.own.number, k))
            device.give()
        assert b.rig.controller.state is state


def test_a_number_far_ahead_is_not_believed_and_the_owner_is_heard_on() -> None:
    now = [0.0]
    master = Master(lambda: now[0], first=17)
    master.claim(7, powered=False)
    own = Session(number=master.session)
    for _ in range(40):
        now[0] += 0.05
        assert not master.beat(own.number, (own.heartbeats + 5000) % NUMBERS)
        assert master.beat(own.number, own.next_heartbeat())
        with pytest.raises(RequestRefused, match="does not follow"):
            master.obeys(own.number, (own.commands + WINDOW + 1) % NUMBERS)
        assert master.obeys(own.number, own.next_command())


def test_a_host_whose_wire_was_cut_for_as_long_as_it_tries_is_heard_again() -> None:
    now = [0.0]
    master = Master(lambda: now[0], first=17)
    master.claim(7, powered=False)
    own = Session(number=master.session)
    for _ in range(round((STATE_S + STOP_S) / POLL_S)):
        now[0] += POLL_S
        own.next_heartbeat(), own.next_command()
    assert master.beat(own.number, own.next_heartbeat())
    assert master.obeys(own.number, own.next_command())


@pytest.mark.parametrize("wire", WIRES)
def test_who_only_reads_feeds_no_watchdog_and_disturbs_nothing(bench: Callable[..., Any], wire: str) -> None:
    b = bench(speed=1.0)
    reader = wire_to(wire, b.rig, b.clock)
    reader.identify(1.0)
    b.command(Control.HOLD)
    for _ in range(200):
        b.wait(0.005)
        reader.status(1.0)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert reader.status(1.0).first_fault is Fault.HEARTBEAT


def test_the_pressure_of_a_rig_whose_host_has_died_is_switched_off(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    b.command(Control.HOLD)
    b.wait(0.1)
    b.direct(0.0, 1.0)
    b.wait(0.2)
    b.beat()
    assert b.rig.status().current_a > 0.9
    b.wait(0.7)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert abs(b.rig.status().current_a) < 0.01, "the current falls with the fault"
    b.wait(9.0)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    b.wait(1.5)
    assert b.rig.controller.state is RigState.FAULT_DISABLED


def test_a_rig_without_power_drives_no_current(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    play(DirectTransport(b.rig, b.clock), a_sine(450), tmp_path, clock=b.clock, settings=QUICK)
    b.wait(0.2)
    assert b.rig.controller.state is RigState.DISABLED
    assert abs(b.rig.status().current_a) < 5e-3
