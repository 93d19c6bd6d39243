"""After any fault of stream or specimen the rig stops without a step and reports the fault."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigctl.device import SAFE_STATES, Control, Fault, RigState
from rigctl.limits import Configuration, Limits
from rigctl.transport import SetpointBlock
from sim_rig.errors import RequestRefused

LIMITS = Limits(position_min_m=-0.05, position_max_m=0.05, velocity_m_s=1.0)
RUN = 5


def start(bench: Any, x: np.ndarray, *, end: bool = True, current: float = 1.0, limits: Limits = LIMITS) -> None:
    """Enable the rig and let it play `x` from its FIFO."""
    rig = bench.rig
    bench.command(Control.DISABLE, RUN)
    bench.configure(Configuration(prefill_samples=10, limits=limits))
    bench.command(Control.HOLD, RUN)
    feed(bench, x, end=end, current=current)
    bench.command(Control.ACTIVATE, RUN)
    assert rig.controller.state is RigState.ACTIVE


def feed(bench: Any, x: np.ndarray, *, first: int = 0, end: bool = False, current: float = 1.0) -> None:
    blocks = [x[k : k + 30] for k in range(0, x.size, 30)]
    for number, part in enumerate(blocks):
        block = SetpointBlock(
            run_id=RUN,
            sequence=first + number,
            displacement_m=part,
            current_a=np.full(part.size, current),
            end_of_stream=end and number == len(blocks) - 1,
        )
        assert bench.rig.controller.accept(block) or bench.rig.controller.faults


def go_on(bench: Any, seconds: float, *, alive: bool = True) -> None:
    for _ in range(round(seconds / 0.005)):
        bench.clock.sleep(0.005)
        if alive:
            bench.beat()
        bench.rig.tick()


def fade(samples: int) -> np.ndarray:
    """From 0 to 1 in 200 samples, with continuous speed."""
    return 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(samples) / 200, 1))


def a_motion(samples: int = 1000, amplitude: float = 0.02) -> np.ndarray:
    return amplitude * np.sin(np.arange(samples) * 2 * np.pi * 3 / 1000) * fade(samples)


def assert_safe(bench: Any, *faults: Fault) -> None:
    controller = bench.rig.controller
    assert controller.state in SAFE_STATES
    assert controller.at_rest
    for fault in faults:
        assert fault in controller.faults
    assert bench.plant.fastest_m_s() <= LIMITS.velocity_m_s * 1.01
    assert bench.plant.hardest_m_s2() <= 300
    commands = np.concatenate(bench.plant.commands)
    assert commands.min() >= LIMITS.position_min_m
    assert commands.max() <= LIMITS.position_max_m


def test_a_stream_that_ends_is_not_an_underflow(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    x = a_motion() * fade(1000)[::-1]
    start(b, x)
    go_on(b, 1.5)
    assert b.rig.controller.state is RigState.HOLD
    assert b.rig.controller.faults is Fault.NONE
    assert b.rig.controller.fifo.consumed == b.rig.controller.store.backlog == 1000
    assert_safe(b)


def test_a_stream_that_is_empty_too_early_at_speed_one_is_an_underflow(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(), end=False)
    go_on(b, 2.0)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert b.rig.controller.underruns == 1
    assert_safe(b, Fault.UNDERFLOW)


def test_at_any_other_speed_the_clock_waits_for_the_host(bench: Callable[..., Any]) -> None:
    b = bench(speed=10.0)
    start(b, a_motion(), end=False)
    go_on(b, 2.0)
    assert b.rig.controller.state is RigState.ACTIVE
    assert b.rig.controller.fifo.consumed == 1000


@pytest.mark.parametrize("speed", [1.0, 10.0])
def test_a_silent_host_stops_the_rig(bench: Callable[..., Any], speed: float) -> None:
    b = bench(speed=speed)
    start(b, a_motion(4000))
    go_on(b, 0.3)
    go_on(b, 1.5 if speed == 1.0 else 6.0, alive=False)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert_safe(b, Fault.HEARTBEAT)


def test_a_host_that_does_not_collect_its_samples_stops_the_rig(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(600))
    b.rig.controller.store.capacity = 400
    go_on(b, 1.0)
    assert_safe(b, Fault.CAPTURE_OVERRUN)
    assert b.rig.controller.store.backlog == 400


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda x: x.__setitem__(700, x[700] + 0.01), Fault.POSITION_JUMP),
        (
            lambda x: x.__setitem__(slice(500, None), x[500:] + 0.1 * (1 - np.cos(np.arange(500) * np.pi / 500))),
            Fault.SETPOINT,
        ),
        (lambda x: x.__setitem__(700, np.nan), Fault.SETPOINT),
    ],
)
def test_a_bad_set_point_stops_the_rig_when_it_arrives_not_when_it_is_due(
    bench: Callable[..., Any], change: Any, fault: Fault
) -> None:
    b, x = bench(speed=1.0), a_motion()
    change(x)
    start(b, x[:300], end=False)
    go_on(b, 0.1)
    feed(b, x[300:], first=10)
    assert b.rig.controller.state is RigState.FAULT_REACTION
    go_on(b, 1.0)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert b.rig.controller.fifo.consumed < 200
    assert_safe(b, fault)


def test_a_stream_that_does_not_begin_at_the_hold_set_point_is_never_played(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, a_motion() + 0.004)
    go_on(b, 0.5)
    assert b.rig.controller.fifo.consumed == 0
    assert_safe(b, Fault.POSITION_JUMP)


def test_a_current_outside_its_limits_is_never_played(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(300), end=False)
    feed(b, a_motion()[300:], first=10, current=2.5)
    go_on(b, 0.5)
    assert_safe(b, Fault.CURRENT_LIMIT)


@pytest.mark.parametrize(
    ("limits", "fault"),
    [
        (Limits(position_min_m=-0.05, position_max_m=0.05, velocity_m_s=1.0, force_n=300.0), Fault.FORCE_LIMIT),
        (
            Limits(position_min_m=-0.05, position_max_m=0.05, velocity_m_s=1.0, following_error_m=2e-4),
            Fault.FOLLOWING_ERROR,
        ),
        (
            Limits(position_min_m=-0.05, position_max_m=0.05, velocity_m_s=1.0, temperature_max_degc=20.0),
            Fault.TEMPERATURE,
        ),
    ],
)
def test_a_detector_stops_the_rig_and_keeps_every_sample_up_to_its_trip(
    bench: Callable[..., Any], limits: Limits, fault: Fault
) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(4000), limits=limits)
    go_on(b, 3.0)
    assert b.rig.controller.state is RigState.FAULT_HOLD
    assert b.rig.controller.first_fault is fault
    assert_safe(b, fault)
    assert b.rig.controller.store.backlog == b.rig.controller.fifo.consumed < 4000


@pytest.mark.parametrize("fault", [Fault.EMERGENCY_STOP, Fault.PRESSURE])
def test_a_hydraulic_interlock_switches_the_pressure_off_at_once_and_stays_until_its_cause_is_gone(
    bench: Callable[..., Any], fault: Fault
) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(4000))
    go_on(b, 0.3)
    b.rig.controller.set_cause(fault, True)
    assert b.rig.controller.state is RigState.FAULT_DISABLED
    for present, state in ((True, RigState.FAULT_DISABLED), (False, RigState.DISABLED)):
        b.rig.controller.set_cause(fault, present)
        with suppress(RequestRefused):
            b.command(Control.DISABLE | Control.RESET, RUN)
        b.command(Control.DISABLE, RUN)
        assert b.rig.controller.state is state


def test_a_stop_in_full_motion_decelerates_to_hold_and_then_disables(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, a_motion(4000, 0.04))
    go_on(b, 0.42)
    b.command(Control.DISABLE, RUN)
    assert b.rig.controller.state is RigState.HOLD
    go_on(b, 0.5)
    assert b.rig.controller.state is RigState.DISABLED
    assert_safe(b)


def test_a_stop_that_is_repeated_at_every_sample_takes_no_longer(bench: Callable[..., Any]) -> None:
    stopped = []
    for again in (0, 100):
        b = bench(speed=1.0)
        start(b, a_motion(4000, 0.04), limits=replace(LIMITS, acceleration_m_s2=20.0))
        go_on(b, 0.66)
        b.rig.stop()
        for _ in range(again):
            b.rig.controller.advance(1)
            b.rig.stop()
        b.wait(0.5)
        assert b.rig.controller.state is RigState.DISABLED
        stopped.append(float(b.rig.controller._setpoint[0]))
    assert stopped[0] == stopped[1]


def test_hold_stops_a_travel(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    b.command(Control.HOLD, RUN)
    b.direct(0.07, 0.0)
    go_on(b, 0.6)
    b.command(Control.HOLD, RUN)
    went = b.rig.status().displacement_m
    go_on(b, 1.0)
    assert b.rig.status().arrived
    assert b.rig.status().displacement_m == pytest.approx(went, abs=3e-3)
    assert_safe(b)


def test_a_repeated_start_of_a_run_that_is_over_moves_nothing(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    start(b, np.zeros(60))
    go_on(b, 0.5)
    b.command(Control.ACTIVATE, RUN)
    assert b.rig.controller.state is RigState.HOLD


def test_direct_set_points_have_an_effect_in_hold_only_and_inside_the_limits(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    with pytest.raises(RequestRefused, match="no effect in DISABLED"):
        b.direct(0.01, 0.0)
    b.configure(Configuration(limits=LIMITS))
    b.command(Control.HOLD, RUN)
    with pytest.raises(RequestRefused, match="outside the limits"):
        b.direct(0.06, 0.0)
    b.direct(0.03, 0.0)
    b.direct(0.03, 0.0)
    go_on(b, 2.0)
    assert b.rig.status().arrived
    assert b.rig.status().displacement_m == pytest.approx(0.03, abs=2e-4)
    assert_safe(b)


def test_limits_may_only_be_tighter_than_the_machines_and_only_while_disabled(bench: Callable[..., Any]) -> None:
    b = bench()
    with pytest.raises(RequestRefused, match="tighter"):
        b.configure(Configuration(limits=Limits(force_n=1e6)))
    with pytest.raises(RequestRefused, match="FIFO"):
        b.configure(Configuration(high_water_samples=20_000))
    b.command(Control.HOLD, RUN)
    with pytest.raises(RequestRefused, match="cannot be changed in HOLD"):
        b.configure(Configuration())
