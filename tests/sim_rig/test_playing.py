"""Whichever call fails, a test ends with a safe rig and a file with a correct status."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.device import SAFE_STATES, Fault, RigState
from rigctl.errors import (
    GateError,
    LimitError,
    NeedsReset,
    RigError,
    RigFault,
    RunFileError,
    StopFailed,
    TransportError,
    TransportTimeout,
)
from rigctl.limits import Limits
from rigctl.operator_acts import reset
from rigctl.player import PlayerSettings, play
from rigctl.procedures.mounting import jog
from rigctl.progress import Phase, Progress
from rigctl.runfile import Run, read_run
from rigctl.transport import Transport
from sim_rig.direct import DirectTransport
from tests.sim_rig.virtual import WIRES, wire_to

QUICK = PlayerSettings(ramp_s=0.1)


def names(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir()) if directory.exists() else []


def play_on(bench: Any, test: Test, out: Path, **more: Any) -> Run:
    wire = more.pop("wire", None) or DirectTransport(bench.rig, bench.clock)
    settings = more.pop("settings", QUICK)
    return read_run(play(wire, test, out, clock=bench.clock, settings=settings, **more))


@pytest.mark.parametrize("speed", [1.0, 20.0])
def test_a_complete_run_holds_the_excitation_from_its_first_sample(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, speed: float
) -> None:
    b, test, seen = bench(speed=speed), a_sine(2000), list[Progress]()
    run = play_on(b, test, tmp_path, on_progress=seen.append, specimen="s7", campaign_id="c", test_id="t")
    assert (run.status, run.samples, run.period_samples, run.excitation_kind) == ("complete", 2000, 200, "sine")
    assert (run.specimen, run.campaign_id, run.test_id, run.design) == ("s7", "c", "t", test.excitation.design)
    np.testing.assert_array_equal(run.channels["displacement_command"], test.excitation.displacement_m)
    np.testing.assert_array_equal(run.channels["current_command"], test.excitation.current_a)
    error = run.channels["displacement"] - run.channels["displacement_command"]
    assert np.std(error) < 0.1 * np.std(run.channels["displacement_command"])
    assert np.max(np.abs(run.channels["current"][1:] - run.channels["current_command"][1:])) < 0.02
    assert np.mean(run.channels["force"] * np.gradient(run.channels["displacement"])) > 0
    assert [p.phase for p in seen][:2] == [Phase.CONNECTING, Phase.STARTING]
    assert (seen[-1].phase, seen[-1].samples) == (Phase.STOPPED, 2000)
    assert b.rig.controller.state is RigState.DISABLED
    assert names(tmp_path) == ["sine.h5"]


def test_what_is_captured_depends_on_the_seed_and_not_on_the_speed(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    runs = []
    for number, (seed, call_s, speed) in enumerate([(3, 5e-4, 20), (3, 3e-3, 20), (3, 5e-4, 500), (4, 5e-4, 20)]):
        b = bench(speed=float(speed), seed=seed)
        wire = DirectTransport(b.rig, b.clock, call_s=call_s)
        play_on(b, a_sine(300, name="first"), tmp_path / str(number), wire=wire)
        runs.append(play_on(b, replace(a_sine(500), dwell_s=0.7), tmp_path / str(number), wire=wire))
    for name, values in runs[0].channels.items():
        np.testing.assert_array_equal(runs[1].channels[name], values)
        np.testing.assert_array_equal(runs[2].channels[name], values)
    assert np.any(runs[3].channels["force"] != runs[0].channels["force"])


def test_a_second_run_of_a_test_never_overwrites_the_first(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench()
    for _ in range(3):
        play_on(b, a_sine(100, name="a/b: c"), tmp_path)
    assert names(tmp_path) == ["a_b_c-2.h5", "a_b_c-3.h5", "a_b_c.h5"]


class FailNth:
    """Fails calls of a transport: the request is lost, or its answer, once or for good."""

    url = "failing"

    def __init__(self, inner: Transport, clock: Any, nth: int, *, answer: bool, for_good: bool) -> None:
        self.inner, self.clock, self.nth, self.answer, self.for_good, self.calls = (
            inner,
            clock,
            nth,
            answer,
            for_good,
            0,
        )
        self.capture_samples = inner.capture_samples

    @property
    def block_samples(self) -> int:
        return self.inner.block_samples

    def _call(self, name: str, *args: Any) -> Any:
        self.calls += 1
        fails = self.calls == self.nth or (self.for_good and self.calls > self.nth)
        if fails and not self.answer:
            self.clock.sleep(args[-1])
            raise TransportTimeout("the request was lost")
        result = getattr(self.inner, name)(*args)
        if fails:
            self.clock.sleep(args[-1])
            raise TransportTimeout("the answer was lost")
        return result

    def identify(self, *args: Any) -> Any:
        return self._call("identify", *args)

    @property
    def session(self) -> int:
        return self.inner.session

    def claim(self, *args: Any) -> Any:
        return self._call("claim", *args)

    def release(self, *args: Any) -> Any:
        return self._call("release", *args)

    def stop(self, *args: Any) -> Any:
        return self._call("stop", *args)

    def configure(self, *args: Any) -> Any:
        return self._call("configure", *args)

    def command(self, *args: Any) -> Any:
        return self._call("command", *args)

    def direct(self, *args: Any) -> Any:
        return self._call("direct", *args)

    def status(self, *args: Any) -> Any:
        return self._call("status", *args)

    def exchange(self, *args: Any) -> Any:
        return self._call("exchange", *args)

    def close(self) -> None:
        pass


def assert_nothing_left_its_limits(bench: Any) -> None:
    assert bench.plant.fastest_m_s() < 1.0
    commands = np.concatenate(bench.plant.commands)
    assert np.max(np.abs(commands)) < 0.02
    assert np.max(np.abs(bench.plant.travelled_m)) < 0.02


LONGER = [pytest.param(name, marks=pytest.mark.slow) for name in WIRES if name != "direct"]


@pytest.mark.parametrize("name", ["direct", *LONGER])
@pytest.mark.parametrize("answer", [False, True])
def test_whichever_single_call_fails_the_run_is_complete_and_exact(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, answer: bool, name: str
) -> None:
    test = a_sine(150)
    for nth in count(1):
        b = bench(speed=20.0)
        wire = FailNth(wire_to(name, b.rig, b.clock), b.clock, nth, answer=answer, for_good=False)
        run = play_on(b, test, tmp_path / str(nth), wire=wire)
        assert (run.status, run.samples) == ("complete", 150)
        expected = test.excitation.displacement_m
        assert np.max(np.abs(run.channels["displacement"] - expected)) < 2e-3
        assert b.rig.controller.state is RigState.DISABLED
        assert b.rig.controller.fifo.consumed == 350
        assert_nothing_left_its_limits(b)
        if wire.calls < nth:
            return


@pytest.mark.slow
@pytest.mark.parametrize("answer", [False, True])
def test_whichever_single_call_fails_a_run_that_holds_is_complete_and_exact(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, answer: bool
) -> None:
    test, events = a_sine(150), set()
    for nth in count(1, 5):  # every fifth: there are many
        b, asked = bench(speed=1.0), count()
        wire = FailNth(wire_to("direct", b.rig, b.clock), b.clock, nth, answer=answer, for_good=False)
        hold = lambda b=b, asked=asked: b.rig.controller.fifo.consumed > 120 and next(asked) < 3  # noqa: E731
        run = play_on(b, test, tmp_path / str(nth), wire=wire, should_hold=hold)
        assert (run.status, run.samples) == ("complete", 150)
        events.add(tuple(text for _, text in run.events))  # none where the rig has played on while the call failed
        np.testing.assert_array_equal(run.channels["displacement_command"], test.excitation.displacement_m)
        assert np.max(np.abs(run.channels["displacement"] - test.excitation.displacement_m)) < 2e-3
        assert b.rig.controller.state is RigState.DISABLED
        assert_nothing_left_its_limits(b)
        if wire.calls < nth:
            assert events <= {("hold", "resumed"), ()}
            assert ("hold", "resumed") in events
            return


@pytest.mark.parametrize(
    ("speed", "name"), [(1.0, "direct"), *(pytest.param(20.0, name, marks=pytest.mark.slow) for name in WIRES)]
)
def test_from_whichever_call_the_wire_is_cut_the_rig_ends_safe_and_the_status_of_the_file_is_right(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, speed: float, name: str
) -> None:
    test = a_sine(150)
    for nth in count(1, 1 if speed > 1 else 11):  # in real time a rig that goes on for seconds costs as much
        b, out = bench(speed=speed), tmp_path / str(nth)
        wire = FailNth(wire_to(name, b.rig, b.clock), b.clock, nth, answer=False, for_good=True)
        error: RigError | None = None
        try:
            play_on(b, test, out, wire=wire)
        except RigError as caught:
            error = caught
        b.wait(1.5 if speed == 1.0 else 6.0)
        assert b.rig.controller.state in SAFE_STATES, f"not safe after call {nth}"
        assert b.rig.controller.at_rest
        assert_nothing_left_its_limits(b)
        files = names(out)
        for file in files:
            run = read_run(out / file)
            assert run.status == ("complete" if error is None else "truncated") or run.samples == 150
            np.testing.assert_array_equal(
                run.channels["displacement_command"], test.excitation.displacement_m[: run.samples]
            )
        if error is not None and files:
            assert error.run_path == out / files[0]
        if wire.calls < nth:
            assert error is None
            return
        if error is None:  # it was cut after the run, while the rig was given up
            assert [read_run(out / file).status for file in files] == ["complete"]
        else:
            assert isinstance(error, (TransportError, StopFailed))


def test_a_stop_at_any_moment_is_an_aborted_run_of_what_was_played(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    test, ended = a_sine(300), set()
    for nth in count(1, 3):
        b, asked, out = bench(speed=20.0), count(1), tmp_path / str(nth)
        stop = lambda asked=asked, nth=nth: "the operator" if next(asked) >= nth else None  # noqa: E731
        run, refusal = None, ""
        try:
            run = play_on(b, test, out, should_stop=stop)
        except RigFault as error:
            refusal = str(error)
        b.wait(0.5)
        assert b.rig.controller.state is RigState.DISABLED
        assert_nothing_left_its_limits(b)
        if run is None:
            assert "before it began" in refusal
            assert names(out) == []
            continue
        ended.add(run.status)
        if run.status == "complete":
            break
        assert "the operator" in run.events[-1][1]
        assert b.rig.controller.store.backlog == 0 or run.samples == 300
    assert ended == {"aborted", "complete"}


def test_a_stop_ends_the_travel_to_the_start_of_a_test(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    wire = DirectTransport(b.rig, b.clock)
    jog(wire, b.clock, to_m=-0.02)
    with pytest.raises(RigFault, match="enough"):
        play(
            wire,
            a_sine(300),
            tmp_path,
            clock=b.clock,
            settings=QUICK,
            should_stop=lambda: "enough" if b.rig.status().displacement_m > -0.015 else None,
        )
    assert b.rig.controller.state is RigState.DISABLED
    assert b.rig.status().displacement_m == pytest.approx(-0.015, abs=4e-3)


def test_an_interrupt_leaves_a_safe_rig_and_an_aborted_run(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)

    def interrupt(progress: Progress) -> None:
        if progress.samples > 500:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        play_on(b, a_sine(2000), tmp_path, on_progress=interrupt)
    assert b.rig.controller.state is RigState.DISABLED
    run = read_run(tmp_path / "sine.h5")
    assert (run.status, run.events[-1][1]) == ("aborted", "aborted: KeyboardInterrupt")
    assert 500 < run.samples < 2000


def test_a_second_interrupt_while_the_rig_stops_does_not_leave_it_moving(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    wire = DirectTransport(b.rig, b.clock)
    command, interrupts = wire.command, iter([True, True])

    def impatient(control: Any, run_id: int, deadline_s: float) -> Any:
        if b.rig.controller.state is RigState.ACTIVE and next(interrupts, False):
            raise KeyboardInterrupt
        return command(control, run_id, deadline_s)

    def interrupt(progress: Progress) -> None:
        if progress.samples > 500 and progress.phase is Phase.RUNNING:
            raise KeyboardInterrupt

    wire.command = impatient  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        play_on(b, a_sine(2000), tmp_path, on_progress=interrupt, wire=wire)
    assert b.rig.controller.state is RigState.DISABLED
    assert read_run(tmp_path / "sine.h5").status == "aborted"


def test_a_fault_of_the_rig_is_raised_in_words_and_the_samples_that_show_it_are_kept(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b, settings = bench(speed=1.0), replace(QUICK, limits=Limits(force_n=700.0))
    time = np.arange(2000) / 1000
    growing = Excitation(
        kind=Kind.SWEEP,
        sample_rate_hz=1000.0,
        period_samples=0,
        displacement_m=0.03 * time * np.sin(9 * time),
        current_a=np.ones(2000),
    )
    with pytest.raises(RigFault, match="force limit") as caught:
        play_on(b, Test(name="growing", excitation=growing), tmp_path, settings=settings)
    assert caught.value.run_path is not None
    run = read_run(caught.value.run_path)
    assert run.status == "aborted"
    assert np.max(np.abs(run.channels["force"])) > 700
    assert b.rig.controller.state is RigState.FAULT_DISABLED
    with pytest.raises(NeedsReset, match=r"force limit.*rig reset"):
        play_on(b, a_sine(100), tmp_path)
    reset(DirectTransport(b.rig, b.clock), b.clock)
    assert play_on(b, a_sine(100), tmp_path).status == "complete", "an operator has reset the rig"


def test_an_emergency_stop_that_is_still_pressed_keeps_the_rig_off(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    b.rig.controller.set_cause(Fault.EMERGENCY_STOP, True)
    with pytest.raises(NeedsReset, match="emergency stop"):
        play_on(b, a_sine(), tmp_path)
    with pytest.raises(RigFault, match="emergency stop"):
        reset(DirectTransport(b.rig, b.clock), b.clock)
    assert b.rig.controller.state is RigState.FAULT_DISABLED
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("amplitude", "frequency", "words"),
    [(0.2, 1.0, "displacement leaves"), (0.07, 10.0, "velocity leaves")],
)
def test_a_waveform_outside_the_limits_is_refused_before_anything_moves(
    bench: Callable[..., Any],
    a_sine: Callable[..., Test],
    tmp_path: Path,
    amplitude: float,
    frequency: float,
    words: str,
) -> None:
    b = bench()
    with pytest.raises(LimitError, match=words) as caught:
        play_on(b, a_sine(1000, amplitude_m=amplitude, frequency_hz=frequency), tmp_path)
    assert "\n" not in str(caught.value)
    assert "'sine'" in str(caught.value)
    assert b.rig.controller.sample_index == 0
    assert names(tmp_path) == []


def test_a_sample_rate_that_the_rig_does_not_play_is_refused(bench: Callable[..., Any], tmp_path: Path) -> None:
    excitation = Excitation(
        kind=Kind.CUSTOM, sample_rate_hz=20.0, period_samples=0, displacement_m=np.zeros(9), current_a=None
    )
    with pytest.raises(LimitError, match="sample_rate is 20 Hz"):
        play_on(bench(), Test(name="slow", excitation=excitation), tmp_path)


def test_a_passive_run_has_no_current(bench: Callable[..., Any], tmp_path: Path) -> None:
    x = 0.01 * np.sin(np.arange(300) / 30)
    excitation = Excitation(kind=Kind.CUSTOM, sample_rate_hz=1000.0, period_samples=0, displacement_m=x)
    run = play_on(bench(), Test(name="p", excitation=excitation), tmp_path)
    assert set(run.channels) == {"force", "displacement", "displacement_command", "temperature", "pressure"}


def test_a_dwell_and_a_temperature_gate_wait_on_the_rigs_clock(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=50.0)
    play_on(b, replace(a_sine(100), dwell_s=20.0), tmp_path)
    assert 20_000 <= b.rig.controller.sample_index < 25_000
    play_on(b, replace(a_sine(100), max_temperature_degc=24.6), tmp_path)
    assert b.rig.controller.measured[3] < 24.8
    with pytest.raises(GateError, match="warm-up"):
        play_on(b, replace(a_sine(100), min_temperature_degc=40.0), tmp_path)
    with pytest.raises(GateError, match="after 30 s of waiting"):
        play_on(b, replace(a_sine(100), max_temperature_degc=5.0), tmp_path, settings=replace(QUICK, gate_s=30.0))
    assert b.rig.controller.state is RigState.DISABLED


def test_a_rig_whose_clock_has_stopped_is_noticed(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b = bench(speed=1.0)
    b.rig._advance = lambda: None
    with suppress(StopFailed), pytest.raises(TransportError):
        play_on(b, a_sine(), tmp_path)
    assert b.clock.now() < 30.0


def test_an_output_that_cannot_be_written_is_refused_before_the_pump_is_asked_for(
    bench: Callable[..., Any], a_sine: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    rig = bench()
    with pytest.raises(RunFileError, match="cannot be written"):
        play(DirectTransport(rig.rig, rig.clock), a_sine(), tmp_path / "file" / "runs", clock=rig.clock)
    assert rig.rig.controller.sample_index == 0
    assert rig.rig.controller.state is RigState.DISABLED
