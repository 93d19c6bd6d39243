"""Hold and resume lose and double no sample; warm-ups, gates and interlocks do what the plan says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.axis import Axis
from rigctl.device import Control, Fault, RigState
from rigctl.errors import GateError, InterlockTripped, LimitError, RigFault, TooCold, TransportError, TransportTimeout
from rigctl.interlocks import HoldWatch, Interlock, InterlockWatch, interlock
from rigctl.limits import Configuration
from rigctl.player import PlayerSettings, play
from rigctl.preparation import WarmUp
from rigctl.progress import Phase, Progress
from rigctl.runfile import Run, read_run
from rigctl.transport import Identity, Reply, SetpointBlock, Status
from rigctl.warm_up import short_of, warmed_up
from sim_rig.direct import DirectTransport
from sim_rig.rig import MACHINE
from tests.sim_rig.virtual import WIRES, wire_to

QUICK = PlayerSettings(ramp_s=0.1)


def play_on(bench: Any, test: Test, out: Path, **more: Any) -> Run:
    wire = more.pop("wire", None) or DirectTransport(bench.rig, bench.clock)
    return read_run(play(wire, test, out, clock=bench.clock, settings=more.pop("settings", QUICK), **more))


def held(asked: range) -> Callable[[], bool]:
    """Requests a hold at some of the times when the player asks."""
    moments = count()
    return lambda: next(moments) in asked


def a_record(samples: int = 900) -> Test:
    """A motion in which all samples are different."""
    t = np.arange(samples) / 1000
    x = 0.01 * np.sin(2 * np.pi * (3 + 2 * t) * t) + 0.004 * t
    current = 0.6 + 0.5 * t / t[-1]
    excitation = Excitation(
        kind=Kind.SWEEP, sample_rate_hz=1000.0, period_samples=0, displacement_m=x, current_a=current
    )
    return Test(name="record", excitation=excitation)


OTHER_WIRES = [pytest.param(wire, marks=pytest.mark.slow) for wire in WIRES if wire != "direct"]


@pytest.mark.parametrize("wire", ["direct", *OTHER_WIRES])
@pytest.mark.parametrize("speed", [1.0, pytest.param(20.0, marks=pytest.mark.slow)])
def test_hold_and_resume_lose_and_double_no_sample_whenever_it_is(
    bench: Callable[..., Any], tmp_path: Path, wire: str, speed: float
) -> None:
    test, events, first = a_record(), set(), 0
    while True:
        b, seen, moments = bench(speed=speed), list[Progress](), count()
        asked = range(first, first + 12)
        run = play_on(
            b,
            test,
            tmp_path / str(first),
            wire=wire_to(wire, b.rig, b.clock),
            should_hold=lambda moments=moments, asked=asked: next(moments) in asked,
            on_progress=seen.append,
        )
        assert (run.status, run.samples) == ("complete", 900)
        np.testing.assert_array_equal(run.channels["displacement_command"], test.excitation.displacement_m)
        error = run.channels["displacement"] - run.channels["displacement_command"]
        assert np.max(np.abs(error)) < 2e-3
        assert np.max(np.abs(run.channels["current"][1:] - run.channels["current_command"][1:])) < 0.02
        assert b.rig.controller.state is RigState.DISABLED
        assert b.plant.fastest_m_s() < 1.0
        assert b.plant.hardest_m_s2() < 1000
        events.add(tuple(text for _, text in run.events))
        phases = [p.phase for p in seen]
        assert (Phase.HOLDING in phases) >= (Phase.RESUMING in phases)
        if next(moments) <= first:
            break
        first += 25 if speed == 1.0 else 4
    assert ("hold", "resumed") in events


def test_a_run_that_was_held_measures_what_one_that_was_not_measures(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    settings = replace(QUICK, ramp_s=0.4)
    whole = play_on(bench(), a_sine(2000), tmp_path, settings=settings)
    parts = play_on(bench(), a_sine(2000), tmp_path, settings=settings, should_hold=held(range(60, 90)))
    assert [text for _, text in parts.events] == ["hold", "resumed"]
    difference = parts.channels["force"] - whole.channels["force"]
    assert np.std(difference) < 0.03 * np.std(whole.channels["force"])


def test_a_test_that_holds_can_be_stopped_and_a_fault_in_hold_is_reported(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b, phases = bench(speed=1.0), list[Phase]()
    reason = lambda: "enough" if phases and phases[-1] is Phase.HOLD else None  # noqa: E731
    run = play_on(
        b,
        a_record(),
        tmp_path,
        should_hold=lambda: len(phases) > 4,
        should_stop=reason,
        on_progress=lambda p: phases.append(p.phase),
    )
    assert run.status == "aborted"
    assert 0 < run.samples < 900
    assert run.events[-1][1] == "aborted: enough"
    b, seen = bench(speed=1.0), list[Phase]()

    def press(progress: Progress) -> None:
        seen.append(progress.phase)
        if progress.phase is Phase.HOLD:
            b.rig.controller.set_cause(Fault.EMERGENCY_STOP, True)

    with pytest.raises(RigFault, match="emergency stop") as caught:
        play_on(b, a_record(), tmp_path, should_hold=lambda: len(seen) > 4, on_progress=press)
    assert caught.value.run_path is not None
    assert read_run(caught.value.run_path).status == "aborted"


def test_a_host_that_dies_in_hold_leaves_a_rig_that_says_so(bench: Callable[..., Any], tmp_path: Path) -> None:
    b, seen = bench(speed=1.0), list[Phase]()

    def sleep(progress: Progress) -> None:
        seen.append(progress.phase)
        if progress.phase is Phase.HOLD:
            b.wait(2.0)

    with pytest.raises(RigFault, match="heartbeat"):
        play_on(b, a_record(), tmp_path, should_hold=lambda: len(seen) > 4, on_progress=sleep)
    assert b.rig.controller.state is RigState.FAULT_DISABLED


def test_a_periodic_excitation_settles_before_it_counts(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    def drift(settle_s: float) -> float:
        run = play_on(bench(), a_sine(2000), tmp_path, settings=replace(QUICK, settle_s=settle_s))
        first, last = run.channels["temperature"][:50], run.channels["temperature"][-50:]
        assert run.samples == 2000
        return float(np.mean(first) - np.mean(last)) + float(np.mean(last))

    assert drift(5.0) > drift(0.0) + 0.5, "five seconds more at full size have warmed the damper"


@pytest.mark.parametrize(
    ("action", "error", "samples"),
    [("indicate", None, 900), ("hold", GateError, None), ("stop", InterlockTripped, None)],
)
def test_an_interlock_of_the_host_indicates_holds_or_stops(
    bench: Callable[..., Any],
    tmp_path: Path,
    action: str,
    error: type[GateError | InterlockTripped] | None,
    samples: int | None,
) -> None:
    b, test = bench(speed=20.0), a_record()
    settings = replace(QUICK, interlocks=(interlock(f"pressure:3e7:4e7:{action}:0.01"),), gate_s=10.0)
    if error is None:
        run = play_on(b, test, tmp_path, settings=settings)
        assert (run.status, run.samples) == ("complete", samples)
    else:  # a pressure that never comes: the hold has its deadline
        with pytest.raises(error, match="pressure outside") as caught:
            play_on(b, test, tmp_path, settings=settings)
        assert caught.value.run_path is not None
        run = read_run(caught.value.run_path)
        assert run.status == "aborted"
    assert any("interlock: pressure" in text for _, text in run.events)
    assert b.rig.controller.state is RigState.DISABLED


def test_an_interlock_on_the_temperature_holds_until_the_damper_has_cooled(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=5.0)
    settings, heated = replace(QUICK, report_s=0.01, interlocks=(interlock("temperature:-20:26.5:hold"),)), []

    def heat(progress: Progress) -> None:
        if progress.samples > 1000 and not heated:
            b.plant.heat(27.5)
            heated.append(b.rig.controller.sample_index)

    run = play_on(b, a_sine(8000, amplitude_m=0.001), tmp_path, settings=settings, on_progress=heat)
    texts = [text for _, text in run.events]
    assert (run.status, run.samples) == ("complete", 8000)
    assert texts[1:3] == ["hold, interlock: temperature outside -20 … 26.5: hold", "resumed"]
    assert np.max(run.channels["temperature"]) > 27.0 > 26.2 > np.max(run.channels["temperature"][-500:])
    assert texts[3:] == [], "it is well inside when it goes on: no second hold"
    assert b.rig.controller.sample_index - heated[0] > 12_000


def test_a_hold_ends_when_the_value_has_been_inside_by_the_margin_for_the_release_time() -> None:
    one = interlock("temperature:-20:80:hold")
    assert (one.inside_by, one.release_s) == (2.0, 1.0)
    rest = HoldWatch(one, (one,), 1000.0)
    temperature = [81.0, *np.tile([79.9, 80.1], 40), 79.0, *[77.9] * 5, 78.5, *[77.5] * 12, 90.0]
    over = [rest.over(np.array([[0, 0, 0, degc, 0]]), 100 * k) for k, degc in enumerate(temperature)]
    assert over.index(True) == len(temperature) - 3, "ten looks, of 0.1 s, after the last one that was not well inside"
    assert not over[-1]
    chatters = HoldWatch(interlock("temperature:-20:80:hold:0:0:0"), (), 1000.0)
    assert [chatters.over(np.array([[0, 0, 0, degc, 0]]), k) for k, degc in enumerate((80.1, 79.9))] == [False, True]


def test_an_interlock_that_stops_ends_a_test_that_holds_as_well() -> None:
    stop = interlock("pressure:5e6:inf:stop:0.2")
    rest = HoldWatch(None, (stop, interlock("force:-1:1:hold")), 1000.0)
    low, high = np.array([[9, 0, 0, 0, 1e6]]), np.array([[9, 0, 0, 0, 2e7]])
    seen = [rest.stops(row, 100 * k) for k, row in enumerate([high, low, low, high, low, low, low])]
    assert seen == [None] * 6 + [stop]
    assert rest.over(low, 0)


def test_an_interlock_that_is_outside_again_after_a_hold_trips_again(bench: Callable[..., Any], tmp_path: Path) -> None:
    b, held_at = bench(speed=1.0), list[int]()

    def heat(progress: Progress) -> None:
        if progress.phase is Phase.RUNNING and progress.samples > 200 + 300 * len(held_at) and len(held_at) < 2:
            b.plant.heat(40.0)
        if progress.phase is Phase.HOLDING:
            held_at.append(progress.samples)
        if progress.phase in (Phase.HOLD, Phase.RESUMING):
            b.plant.heat(40.0 if progress.phase is Phase.RESUMING and len(held_at) < 2 else 25.0)

    settings = replace(QUICK, report_s=0.0, interlocks=(interlock("temperature:-20:35:hold:0:1:0.1"),))
    run = play_on(b, a_record(), tmp_path, settings=settings, on_progress=heat)
    assert (run.status, run.samples) == ("complete", 900)
    assert [text for _, text in run.events].count("resumed") == 2 == len(held_at)


def test_an_interlock_trips_once_for_each_time_that_it_is_left_for_its_delay() -> None:
    watch = InterlockWatch([interlock("force:-10:10:indicate:0.003")], 1000.0)
    force = np.zeros(40)
    force[5:7] = 20  # too short
    force[10:20] = 20
    force[30:33] = -20
    values = np.zeros((40, 5))
    values[:, 0] = force
    assert sum(len(watch.tripped(values[k : k + 4])) for k in range(0, 40, 4)) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("smell:0:1:stop", "channel 'smell' does not exist"),
        ("force:1:0:stop", "1 must lie below 0"),
        ("force:a:1:stop", "'a'"),
        ("force:0:1:explode", "ACTION one of"),
        ("force", "CHANNEL:LOW:HIGH:ACTION"),
        ("force:0:1:stop:-1", "the delay is -1"),
        ("force:0:1:hold:0:0.5", "the margin is 0.5, it must lie below half the range of 1"),
        ("force:0:1:hold:0:0.1:-2", "the release is -2"),
        ("force:0:1:hold:0:0.1:1:1", "CHANNEL:LOW:HIGH:ACTION"),
    ],
)
def test_an_impossible_interlock_is_refused_in_one_line(text: str, words: str) -> None:
    with pytest.raises(LimitError, match=words) as caught:
        interlock(text)
    assert "\n" not in str(caught.value)
    assert isinstance(interlock("force:-inf:5:stop"), Interlock)


def test_a_cold_damper_is_warmed_up_until_it_is_warm_enough_and_only_the_test_is_recorded(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    wire = DirectTransport(b.rig, b.clock)
    one = partial(play, wire, clock=b.clock, settings=QUICK)
    test = replace(a_sine(200), min_temperature_degc=28.0, max_temperature_degc=60.0)
    warm_up = a_sine(5000, amplitude_m=0.02, name="warm-up")
    with pytest.raises(TooCold, match="warm-up"):
        warmed_up(one, test, tmp_path, None)
    run = read_run(warmed_up(one, test, tmp_path, warm_up))
    assert np.mean(run.channels["temperature"]) > 27.9
    assert [path.name for path in tmp_path.iterdir()] == ["sine.h5"]


def test_a_warm_up_that_does_not_help_has_an_end(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    one = partial(play, DirectTransport(b.rig, b.clock), clock=b.clock, settings=QUICK)
    test = replace(a_sine(200), min_temperature_degc=200.0)
    with pytest.raises(GateError, match="3 s of warm-up were not enough"):
        warmed_up(one, test, tmp_path, a_sine(1000, amplitude_m=1e-4), gate_s=3.0)
    assert b.rig.controller.state is RigState.DISABLED


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("when", [Phase.WAITING, Phase.HOLD])
def test_a_rig_that_lost_its_power_while_it_waited_is_not_driven_with_another_configuration(
    bench: Callable[..., Any], tmp_path: Path, wire: str, when: Phase
) -> None:
    b, seen = bench(speed=1.0), list[Phase]()

    def cut(progress: Progress) -> None:
        seen.append(progress.phase)
        if progress.phase is when and seen.count(when) == 1:
            b.rig._lose_power()
            b.rig.starts += 1

    with pytest.raises(TransportError, match="the rig was restarted"):
        play_on(
            b,
            replace(a_record(), dwell_s=1.0),
            tmp_path,
            wire=wire_to(wire, b.rig, b.clock),
            should_hold=lambda: seen.count(Phase.RUNNING) > 1 and seen.count(Phase.HOLD) < 20,
            on_progress=cut,
        )
    assert b.rig.controller.state is RigState.DISABLED
    assert when in seen
    assert Phase.RESUMING not in seen


class Listened(DirectTransport):
    """A wire that keeps the names of the calls, and may show another status."""

    def __init__(self, bench: Any, **shown: Any) -> None:
        super().__init__(bench.rig, bench.clock)
        self.calls, self._shown = list[str](), shown

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        self.calls.append(str(control.name))
        return replace(super().command(control, run_id, deadline_s), **self._shown)

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        self.calls.append("fetch" if block is None else "exchange")
        return super().exchange(block, run_id, captured, deadline_s)

    def status(self, deadline_s: float) -> Status:
        return replace(super().status(deadline_s), **self._shown)


@pytest.mark.parametrize("asked_in", ["rest", "drain"])
def test_a_stop_that_is_asked_for_on_the_way_to_a_hold_is_obeyed_at_once(
    bench: Callable[..., Any], tmp_path: Path, asked_in: str
) -> None:
    b, phases = bench(speed=1.0), list[Phase]()
    wire = Listened(b)

    def reason() -> str | None:
        holding = Phase.HOLDING in phases and (asked_in == "rest" or b.rig.controller.arrived)
        return "enough" if holding else None

    run = play_on(
        b,
        a_record(),
        tmp_path,
        wire=wire,
        should_hold=lambda: b.rig.controller.fifo.consumed > 300,
        should_stop=reason,
        on_progress=lambda p: phases.append(p.phase),
    )
    assert run.status == "aborted"
    assert "hold" not in [text for _, text in run.events]
    held_at = len(wire.calls) - 1 - wire.calls[::-1].index(str(Control.HOLD.name))
    assert wire.calls[held_at + 1] == Control.DISABLE.name, "nothing is fetched before the stop"
    assert b.rig.controller.state is RigState.DISABLED


@pytest.mark.parametrize("gate", [{"min_temperature_degc": 20.0}, {"max_temperature_degc": 40.0}])
def test_a_temperature_that_is_no_number_or_not_measured_opens_no_gate(
    bench: Callable[..., Any], tmp_path: Path, gate: dict[str, float]
) -> None:
    test = replace(a_record(), **gate)
    for reading in (float("nan"), float("inf"), float("-inf")):
        b = bench()
        with pytest.raises(GateError, match=f"temperature of the damper reads {reading} °C"):
            play_on(b, test, tmp_path / "runs", wire=Listened(b, temperature_degc=reading))
        assert not np.any(np.concatenate(b.plant.commands))

    class Blind(DirectTransport):
        def identify(self, deadline_s: float) -> Identity:
            return replace(super().identify(deadline_s), unmeasured=("temperature",))

    b = bench()
    with pytest.raises(GateError, match="does not measure a temperature"):
        play_on(b, test, tmp_path / "runs", wire=Blind(b.rig, b.clock))
    strict = replace(QUICK, interlocks=(interlock("temperature:-20:80:hold"),))
    with pytest.raises(LimitError, match="does not measure temperature"):
        play_on(b, a_record(), tmp_path / "runs", wire=Blind(b.rig, b.clock), settings=strict)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("reading", [float("nan"), 20.0])
def test_a_warm_up_ends_only_at_a_temperature_that_is_one(reading: float) -> None:
    done = WarmUp(
        finished_at="2026-01-01T00:00:00+00:00",
        energy_j=10.0,
        duration_s=9.0,
        plays=1,
        start_degc=20.0,
        end_degc=reading,
    )
    assert "of 30 °C" in short_of(replace(a_record(), to_temperature_degc=30.0), done)


def test_a_slow_travel_has_the_time_that_its_speed_asks_for_and_no_more(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    slow = Configuration(limits=replace(MACHINE, velocity_m_s=0.02), heartbeat_s=5.0)
    axis = Axis(DirectTransport(b.rig, b.clock), b.clock, stall_s=5.0)
    axis.identify(), axis.claim(), axis.prepare(slow)
    began = b.clock.now()
    axis.enable(-0.06, 0.0)
    assert axis.travel(0.06, 0.0).displacement_m == pytest.approx(0.06, abs=5e-4)
    assert b.clock.now() - began > 11.0 + 5.0
    axis.make_safe()
    axis.release()
    stuck = Axis(Listened(b, arrived=False), b.clock, stall_s=5.0)
    stuck.identify(), stuck.claim(), stuck.prepare(slow)
    began = b.clock.now()
    with pytest.raises(TransportTimeout, match=r"not reached within 32.5 s"):  # 2 · 1.875 · 0.12 m / 20 mm/s + 10 s
        stuck.enable(-0.06, 0.0)
    assert 32.0 < b.clock.now() - began < 34.0
