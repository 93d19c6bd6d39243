"""Frames that come late, or again, move nothing: every frame of whole runs is given to the rig once more."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, TypeAlias

import can
import numpy as np
import pytest

from excitation.plan import Test
from rigctl import can_frames as frames
from rigctl.can_wire import CanTransport
from rigctl.device import Control, RigState
from rigctl.errors import RigError, SessionLost
from rigctl.modbus_wire import ModbusTransport
from rigctl.operator_acts import stop
from rigctl.player import PlayerSettings, play
from rigctl.progress import Phase, Progress
from rigctl.runfile import read_run
from rigctl.transport import Transport
from sim_rig.direct import DirectTransport
from tests.sim_rig.virtual import NullModem, VirtualBus

QUICK = PlayerSettings(ramp_s=0.1)
WIRES = ("modbus", "can", "can_fd")
Frame: TypeAlias = Any  # bytes of Modbus, or identifier and bytes of CAN


COMMANDS = (frames.NMT, frames.CONTROL, frames.DIRECT, frames.COMMIT)


def is_command(frame: Frame) -> bool:
    """Whether a frame writes: it could make the rig do something."""
    if isinstance(frame, bytes):
        return frame[7] in (0x06, 0x10, 0x17)
    number, data = frame
    return number in COMMANDS or (number == frames.STREAM and len(data) > 8)


def is_stop(frame: Frame) -> bool:
    """Whether a frame is a stop that is obeyed from anybody: it may come late, it makes the rig safe."""
    if isinstance(frame, bytes):
        return frame[7:12] == bytes([0x10, 0x01, 0x00, 0x00, 0x0A]) and frame[13:17] == bytes([0, 1, 0, 0])
    number, data = frame
    return number == frames.CONTROL and data[:3] == bytes([1, 0, 0])


class Gateway:
    """A wire that keeps every frame of the host, and may hold the nth command back until the test delivers it."""

    def __init__(self, bench: Any, name: str, held_back: int = -1) -> None:
        self.sent: list[Frame] = []
        self._held_back, self._commands = held_back, 0
        self.late: Frame | None = None
        if name == "modbus":
            modem = _Modem(bench, self)
            self.deliver: Callable[[Frame], object] = modem.serve
            self.wire: Transport = ModbusTransport("virtual", 502, clock=bench.clock, client=modem)
        else:
            bus = _Bus(bench, self, fd=name == "can_fd")
            self.deliver = bus.arrive
            self.wire = CanTransport("can://virtual/1", lambda: bus, fd=name == "can_fd", clock=bench.clock)

    def passes(self, frame: Frame) -> bool:
        """Whether a frame of the host goes through now."""
        self.sent.append(frame)
        self._commands += is_command(frame)
        if self.late is None and is_command(frame) and self._commands - 1 == self._held_back:
            self.late = frame
            return False
        return True


class _Modem(NullModem):
    def __init__(self, bench: Any, gateway: Gateway) -> None:
        super().__init__(bench.rig, bench.clock)
        self._gateway = gateway

    def send(self, request: bytes, addr: Any = None) -> int:
        return super().send(request, addr) if self._gateway.passes(request) else len(request)


class _Bus(VirtualBus):
    def __init__(self, bench: Any, gateway: Gateway, *, fd: bool) -> None:
        super().__init__(bench.rig, bench.clock, fd=fd)
        self._gateway = gateway

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self._gateway.passes((msg.arbitration_id, bytes(msg.data))):
            super().send(msg, timeout)

    def arrive(self, frame: Frame) -> None:
        number, data = frame
        self._device.take(number, data)
        self._device.give()


def assert_stays(bench: Any, deliver: Callable[[Frame], object], again: list[Frame]) -> None:
    """Deliver frames one by one, with time after each: the rig keeps its state, its place and its current."""
    rig = bench.rig
    state, before = rig.controller.state, len(bench.plant.commands)
    at = float(rig.controller._setpoint[0])
    for frame in again:
        deliver(frame)
        if state is RigState.HOLD:
            bench.beat()  # the master of the rig lives
        bench.wait(0.02)
        assert rig.controller.state is state, f"frame {frame!r} has an effect"
    moved = np.concatenate([np.full(1, at), *bench.plant.commands[before:]])
    assert np.all(moved == at)
    assert abs(rig.status().current_a) < 5e-3


LONGER = ("aborted", "stopped by somebody else")


@pytest.mark.parametrize("name", ["modbus", *(pytest.param(name, marks=pytest.mark.slow) for name in WIRES[1:])])
@pytest.mark.parametrize("ending", ["complete", *(pytest.param(e, marks=pytest.mark.slow) for e in LONGER)])
def test_no_frame_of_a_run_that_is_over_has_an_effect(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, name: str, ending: str
) -> None:
    b = bench(speed=1.0)
    gateway = Gateway(b, name)
    operator = DirectTransport(b.rig, b.clock)

    def interfere(progress: Progress) -> None:
        if ending.startswith("stopped") and progress.phase is Phase.RUNNING and progress.samples > 100:
            stop(operator, b.clock)

    test = a_sine(300)
    with suppress(SessionLost):
        path = play(
            gateway.wire,
            test,
            tmp_path,
            clock=b.clock,
            settings=replace(QUICK, report_s=0.0),
            on_progress=interfere,
            should_stop=lambda: "enough" if ending == "aborted" and b.rig.controller.fifo.consumed > 150 else None,
        )
        assert read_run(path).status == ending
    sent = list(gateway.sent)
    assert len(sent) > 30
    b.wait(2.0)
    assert b.rig.controller.state is RigState.DISABLED
    assert_stays(b, gateway.deliver, sent)
    b.wait(1.5)  # whoever claimed by an old frame is silent: the rig is free again
    b.command(Control.HOLD, 1)
    b.wait(0.05)
    assert_stays(b, gateway.deliver, [frame for frame in sent if not is_stop(frame)])


@pytest.mark.slow
@pytest.mark.parametrize("name", WIRES)
def test_a_frame_that_a_gateway_delivers_three_seconds_late_has_no_effect(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, name: str
) -> None:
    test, ends = a_sine(80), set[str]()
    for nth in count(0, 1 if name == "can" else 3):
        b = bench(speed=1.0)
        gateway = Gateway(b, name, held_back=nth)
        with suppress(RigError):
            path = play(gateway.wire, test, tmp_path / str(nth), clock=b.clock, settings=QUICK)
            ends.add(read_run(path).status)
        if gateway.late is None:
            break
        b.wait(3.0, step_s=0.05)
        assert not b.rig.controller.state.moving
        assert_stays(b, gateway.deliver, [gateway.late])
    assert "complete" in ends


@pytest.mark.parametrize("name", WIRES)
def test_a_stop_is_obeyed_from_anybody_and_ends_the_session(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, name: str
) -> None:
    b = bench(speed=1.0)
    stranger, stopped_at = Gateway(b, name).wire, list[float]()

    def interfere(progress: Progress) -> None:
        if progress.samples > 300 and not stopped_at:
            stopped_at.append(b.clock.now())
            stranger.stop(1.0)

    with pytest.raises(SessionLost, match="somebody else has stopped") as caught:
        play(
            DirectTransport(b.rig, b.clock),
            a_sine(3000),
            tmp_path,
            clock=b.clock,
            settings=QUICK,
            on_progress=interfere,
        )
    b.wait(1.4)
    assert b.rig.controller.state is RigState.DISABLED
    assert b.rig.master.session == 0
    assert caught.value.run_path is not None
    assert read_run(caught.value.run_path).status == "aborted"
