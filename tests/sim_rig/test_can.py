"""Errors of CAN: frames that are lost, doubled or damaged, a missing bus, a wrong name."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl import can_frames as frames
from rigctl import modbus_map as table
from rigctl import sdo
from rigctl.address import CanAddress, can_address, connect, open_bus
from rigctl.can_wire import CanTransport
from rigctl.device import Control, Fault, RigState
from rigctl.errors import IdentityError, LimitError, TransportError, TransportTimeout, UrlError
from rigctl.loopback_can import LoopbackBus
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.transport import SetpointBlock
from sim_rig.can_server import CanDevice
from sim_rig.fifo import CaptureStore
from sim_rig.registers import RegisterDevice
from tests.sim_rig.virtual import VirtualBus, wire_to


class BadBus(can.BusABC):
    """A bus in this process to a simulated device; every so many frames one is lost, doubled or damaged."""

    def __init__(self, device: CanDevice, clock: Any, rig: Any, *, spoil: Callable[[int, bytes], list[bytes]]) -> None:
        self._device, self._clock, self._rig, self._spoil = device, clock, rig, spoil
        self._inbox: list[tuple[int, bytes]] = []
        self.channel_info = "bad"
        super().__init__("bad")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        for data in self._spoil(msg.arbitration_id, bytes(msg.data)):
            self._device.take(msg.arbitration_id, data)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._inbox and timeout:
            self._clock.sleep(0.001)
            self._rig.tick()
            for number, data in self._device.give():
                self._inbox.extend((number, kept) for kept in self._spoil(number, data))
        if not self._inbox:
            if timeout:
                self._clock.sleep(timeout)
            return None, True
        number, data = self._inbox.pop(0)
        fd = len(data) > 8
        return can.Message(arbitration_id=number, data=data, is_extended_id=False, is_fd=fd), True


def spoiler(kind: str, every: int) -> Callable[[int, bytes], list[bytes]]:
    seen = 0

    def spoil(number: int, data: bytes) -> list[bytes]:
        nonlocal seen
        seen += 1
        if seen % every:
            return [data]
        if kind == "damaged":
            return [data[:3] + bytes([data[3] ^ 0x10]) + data[4:]] if 0x200 < number < 0x580 else [data]
        return {"lost": [], "doubled": [data, data]}[kind]

    return spoil


@pytest.mark.parametrize("fd", [False, True])
@pytest.mark.parametrize(("kind", "every"), [("lost", 997), ("lost", 101), ("doubled", 53), ("none", 10**9)])
def test_frames_that_are_lost_or_doubled_cost_time_and_no_sample(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, fd: bool, kind: str, every: int
) -> None:
    if kind == "lost" and every == 101 and not fd:
        every = 499  # a classic block is 257 frames: one of them lost every 101 never gets through whole
    b = bench(speed=20.0)
    device = CanDevice(b.rig, b.clock.now, fd=fd)
    bus = BadBus(device, b.clock, b.rig, spoil=spoiler(kind, every))
    wire = CanTransport("can://bad/1", lambda: bus, fd=fd, clock=b.clock)
    test = a_sine(600)
    run = read_run(play(wire, test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.1)))
    assert (run.status, run.samples) == ("complete", 600)
    assert np.max(np.abs(run.channels["displacement"] - test.excitation.displacement_m)) < 2e-3
    assert np.all(np.abs(run.channels["current"][2:] - run.channels["current_command"][2:]) < 0.02)
    assert b.rig.controller.state is RigState.DISABLED
    assert b.rig.controller.fifo.consumed == 800
    bus.shutdown()


@pytest.mark.parametrize("fd", [False, True])
def test_damaged_set_points_are_sent_again_and_never_played(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, fd: bool
) -> None:
    b = bench(speed=20.0)
    device = CanDevice(b.rig, b.clock.now, fd=fd)
    spoil = spoiler("damaged", 29 if fd else 401)
    bus = BadBus(device, b.clock, b.rig, spoil=lambda n, d: spoil(n, d) if n in (0x401, 0x201) else [d])
    wire = CanTransport("can://bad/1", lambda: bus, fd=fd, clock=b.clock)
    test = a_sine(600)
    run = read_run(play(wire, test, tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.1)))
    assert (run.status, run.samples) == ("complete", 600)
    assert b.rig.crc_errors > 0
    assert np.max(np.abs(np.concatenate(b.plant.commands))) < 0.0101
    bus.shutdown()


@pytest.mark.parametrize("fd", [False, True])
def test_a_call_asks_again_until_its_deadline_where_the_first_answers_are_lost(
    bench: Callable[..., Any], fd: bool
) -> None:
    b = bench(speed=20.0)
    losing = 0

    def spoil(number: int, data: bytes) -> list[bytes]:
        nonlocal losing
        if number == frames.SDO_ANSWER and losing:
            losing -= 1
            return []
        return [data]

    bus = BadBus(CanDevice(b.rig, b.clock.now, fd=fd), b.clock, b.rig, spoil=spoil)
    wire = CanTransport("can://bad/1", lambda: bus, fd=fd, clock=b.clock)
    wire.claim(1.0)
    wire.command(Control.HOLD, 7, 1.0)
    still = np.zeros(wire.block_samples)
    block = SetpointBlock(run_id=7, sequence=0, displacement_m=still, current_a=still, end_of_stream=False)
    losing = 2
    reply = wire.exchange(block, 7, 0, 1.0)
    assert (reply.last_accepted, reply.refused, losing) == (0, False, 0)
    losing = 10**9
    began = b.clock.now()
    with pytest.raises(TransportTimeout):
        wire.exchange(None, 7, 0, 0.5)
    assert b.clock.now() - began == pytest.approx(0.5, abs=0.02)
    bus.shutdown()


def test_an_address_names_interface_channel_and_rates() -> None:
    assert can_address("can://socketcan/can0?fd=true&bitrate=500000&data_bitrate=2000000") == CanAddress(
        interface="socketcan", channel="can0", fd=True, bitrate=500_000, data_bitrate=2_000_000
    )
    assert can_address("can://loopback/x") == CanAddress(interface="loopback", channel="x")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("can://", "must be"),
        ("can://loopback", "must be"),
        ("can://loopback/x?fd=maybe", "fd is 'maybe'"),
        ("can://loopback/x?bitrate=fast", "bitrate is 'fast'"),
        ("can://loopback/x?bitrate=0", "bitrate is '0'"),
        ("can://loopback/x?speed=1", "option 'speed' is unknown"),
        ("can://telepathy/1", "interface 'telepathy' does not exist"),
    ],
)
def test_a_wrong_can_address_is_refused_in_one_line(url: str, words: str) -> None:
    with pytest.raises(UrlError, match=words) as caught:
        connect(url)
    assert "\n" not in str(caught.value)


def test_a_bus_without_a_rig_is_an_error_in_time() -> None:
    with (
        closing(connect(f"can://loopback/nobody-{os.getpid()}")) as wire,
        pytest.raises(TransportError, match="no rig"),
    ):
        wire.identify(0.3)


def test_a_silent_bus_is_a_time_out() -> None:
    name = f"silent-{os.getpid()}"
    rig = LoopbackBus(name, listen=True)
    with closing(connect(f"can://loopback/{name}")) as wire, pytest.raises(TransportError, match="does not answer"):
        wire.identify(0.3)
    rig.shutdown()


def test_an_interface_without_its_hardware_is_refused_in_one_line() -> None:
    with pytest.raises((can.CanError, OSError, ValueError)):
        open_bus(CanAddress(interface="pcan", channel="PCAN_USBBUS1"))
    with closing(connect("can://pcan/PCAN_USBBUS1")) as wire, pytest.raises(TransportError) as caught:
        wire.identify(0.3)
    assert "\n" not in str(caught.value)


class Foreigner(can.BusABC):
    """A device of another make on the bus, which answers every request with its own data."""

    def __init__(self, answer: Callable[[bytes], bytes], clock: Any) -> None:
        self._answer, self._clock, self._inbox = answer, clock, list[tuple[int, bytes]]()
        self.channel_info, self.asked = "foreign", list[int]()
        super().__init__("foreign")
        self._is_shutdown = True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.asked.append(msg.arbitration_id)
        if msg.arbitration_id == frames.SDO_REQUEST:
            self._inbox.append((frames.SDO_ANSWER, self._answer(bytes(msg.data))))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._inbox and timeout:
            self._clock.sleep(timeout)
            self._inbox.append((frames.RIG_HEARTBEAT, bytes([frames.OPERATIONAL])))
        if not self._inbox:
            return None, True
        number, data = self._inbox.pop(0)
        return can.Message(arbitration_id=number, data=data, is_extended_id=False), True


def aborting(request: bytes) -> bytes:
    return bytes([sdo.ABORT]) + request[1:4] + sdo.NO_SUCH_OBJECT.to_bytes(4, "little")


def of_another_make(request: bytes) -> bytes:
    return bytes([sdo.UPLOADED]) + request[1:4] + (0x12345678).to_bytes(4, "little")


@pytest.mark.parametrize("answer", [aborting, of_another_make])
def test_a_foreign_device_on_the_bus_is_refused_in_one_line_and_gets_no_command(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, answer: Callable[[bytes], bytes]
) -> None:
    b = bench()
    bus = Foreigner(answer, b.clock)
    wire = CanTransport("can://foreign/1", lambda: bus, fd=False, clock=b.clock)
    with pytest.raises(IdentityError, match="a foreign device") as caught:
        play(wire, a_sine(), tmp_path, clock=b.clock)
    assert "\n" not in str(caught.value)
    assert not {frames.CONTROL, frames.DIRECT, frames.STREAM} & set(bus.asked)
    assert list(tmp_path.iterdir()) == []


def test_a_test_that_the_bus_cannot_carry_is_refused_before_anything_moves(
    bench: Callable[..., Any], tmp_path: Path
) -> None:
    b = bench()
    fast = Excitation(
        kind=Kind.CUSTOM, sample_rate_hz=2000.0, period_samples=0, displacement_m=np.linspace(0, 0.01, 900)
    )
    with pytest.raises(LimitError, match=r"loads the bus to 8\d %.*use a lower sample rate or CAN FD"):
        play(wire_to("can", b.rig, b.clock), Test(name="fast", excitation=fast), tmp_path, clock=b.clock)
    assert b.rig.controller.state is RigState.DISABLED
    assert b.rig.controller.fifo.consumed == 0
    assert list(tmp_path.iterdir()) == []
    assert (
        read_run(
            play(wire_to("can_fd", b.rig, b.clock), Test(name="fast", excitation=fast), tmp_path, clock=b.clock)
        ).status
        == "complete"
    )


def device_of(bench: Any) -> tuple[CanDevice, Callable[[], list[tuple[int, bytes]]]]:
    device = CanDevice(bench.rig, bench.clock.now, fd=False)

    def go_on() -> list[tuple[int, bytes]]:
        out = []
        for _ in range(40):
            bench.clock.sleep(0.005)
            bench.rig.tick()
            out.extend(device.give())
        return out

    return device, go_on


def test_the_rig_boots_sends_heartbeats_starts_and_stops_as_the_bus_master_says(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    device, go_on = device_of(b)
    beats = [data[0] for number, data in go_on() if number == frames.RIG_HEARTBEAT]
    assert beats[:2] == [frames.BOOT_UP, frames.PRE_OPERATIONAL]
    assert len(beats) in (4, 5), "one every 50 ms"
    device.take(frames.NMT, bytes([frames.NMT_START, frames.NODE]))
    assert {d[0] for n, d in go_on() if n == frames.RIG_HEARTBEAT} == {frames.OPERATIONAL}
    b.command(Control.HOLD, 1)
    device.take(frames.NMT, bytes([frames.NMT_STOP, 0]))
    assert {d[0] for n, d in go_on() if n == frames.RIG_HEARTBEAT} == {frames.STOPPED}
    assert b.rig.controller.state is RigState.DISABLED


def test_a_fault_and_its_end_are_sent_in_an_emergency_frame(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    device, go_on = device_of(b)
    assert device is not None
    assert not [data for number, data in go_on() if number == frames.EMERGENCY]
    b.rig.controller.set_cause(Fault.EMERGENCY_STOP, True)
    [told] = [data for number, data in go_on() if number == frames.EMERGENCY]
    assert told[:2] == (0x9000).to_bytes(2, "little")
    b.rig.controller.set_cause(Fault.EMERGENCY_STOP, False)
    b.command(Control.DISABLE | Control.RESET, 1)
    [over] = [data for number, data in go_on() if number == frames.EMERGENCY]
    assert over[:4] == bytes(4)


def test_the_error_history_keeps_faults_after_their_reset(bench: Callable[..., Any]) -> None:
    b = bench(speed=1.0)
    wire = wire_to("can", b.rig, b.clock)
    assert isinstance(wire, CanTransport)
    assert wire.error_history(1.0) == []
    for fault in (Fault.EMERGENCY_STOP, Fault.SENSOR):
        b.rig.controller.fail(fault)
        b.command(Control.DISABLE | Control.RESET, 1)
        b.command(Control.DISABLE, 1)
    assert wire.status(1.0).faults is Fault.NONE
    assert wire.error_history(1.0) == [Fault.SENSOR, Fault.EMERGENCY_STOP]


def test_a_full_queue_of_the_driver_is_waited_for_and_one_that_stays_full_is_an_error(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    b, refusals = bench(speed=20.0), [0]

    class Full(VirtualBus):
        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            refusals[0] += 1
            if refusals[0] % 50 == 0 or refusals[0] < 0:
                raise can.CanOperationError("Failed to transmit: No buffer space available", errno.ENOBUFS)
            super().send(msg, timeout)

    opened: list[int] = []

    def open_it() -> can.BusABC:
        opened.append(1)
        return bus

    bus = Full(b.rig, b.clock, fd=False)
    wire = CanTransport("can://full/1", open_it, fd=False, clock=b.clock)
    run = read_run(play(wire, a_sine(600), tmp_path, clock=b.clock, settings=PlayerSettings(ramp_s=0.1)))
    assert (run.status, run.samples, refusals[0] > 500, len(opened)) == ("complete", 600, True, 1)
    refusals[0] = -(10**6)
    began = b.clock.now()
    with pytest.raises(TransportError, match="No buffer space"):
        wire.status(1.0)
    assert b.clock.now() - began < 0.3


class LateStatus(VirtualBus):
    """A bus that gives a status of the run before once more, after each frame of the rig."""

    late: tuple[int, bytes] | None = None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        message, filtered = super()._recv_internal(timeout)
        if self.late is not None and message is not None and message.arbitration_id == frames.SDO_ANSWER:
            self._inbox.insert(0, self.late)
        return message, filtered


@pytest.mark.parametrize("fd", [False, True])
def test_an_acknowledgement_of_a_former_run_is_not_believed(
    bench: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path, fd: bool
) -> None:
    b = bench(speed=1.0)
    bus = LateStatus(b.rig, b.clock, fd=fd)
    wire = CanTransport("can://virtual/1", lambda: bus, fd=fd, clock=b.clock)
    settings = PlayerSettings(ramp_s=0.1)
    play(wire, a_sine(900), tmp_path, clock=b.clock, settings=settings)
    controller = b.rig.controller
    status = frames.StatusFrame(
        state=controller.state.value,
        arrived=True,
        refused=False,
        faults=0,
        fifo_level=0,
        last_accepted=controller.fifo.last_accepted + 40,
        stage=controller.stage,
        session=b.rig.master._following,
        run_id=controller.fifo.run_id,
    )
    bus.late = (frames.STATUS, frames.pack_status(status))
    run = read_run(play(wire, a_sine(900), tmp_path, clock=b.clock, settings=settings))
    assert (run.status, run.samples) == ("complete", 900)


@pytest.mark.parametrize("name", ["modbus", "can", "can_fd"])
def test_a_frame_that_is_65536_numbers_late_is_refused(bench: Callable[..., Any], name: str) -> None:
    b = bench(speed=1.0)
    b.command(Control.HOLD)
    b.rig.controller.fifo.following = 65536
    rows = np.zeros((9, 2))

    def deliver(number: int) -> None:
        block = SetpointBlock(
            run_id=1, sequence=number, displacement_m=rows[:, 0], current_a=rows[:, 1], end_of_stream=False
        )
        if name == "modbus":
            own = b.own
            words = table.encode_write(block, 1, 0, session=own.number, heartbeat=own.next_heartbeat())
            RegisterDevice(b.rig).write(table.WRITE_HEADER.address, words)
            return
        device = CanDevice(b.rig, b.clock.now, fd=name == "can_fd")
        pack = frames.pack_stream_fd if name == "can_fd" else frames.pack_stream
        for frame in pack(rows, number, 1, False, session=b.own.number):
            device.take(*frame)

    deliver(0)
    assert b.rig.controller.fifo.level == 0, "number 0 of this run is over"
    deliver(65536)
    assert b.rig.controller.fifo.level == 9


@given(
    blocks=st.lists(st.integers(0, 5), max_size=8),
    acknowledged=st.integers(0, 12),
    sent=st.integers(0, 40),
    most=st.integers(1, 30),
)
def test_what_is_sent_next_is_what_a_fetch_of_all_holds_beyond_what_was_sent(
    blocks: list[int], acknowledged: int, sent: int, most: int
) -> None:
    store = CaptureStore(run_id=3)
    for k, samples in enumerate(blocks):
        store.append(k + np.arange(5.0 * samples).reshape(samples, 5))
    store.acknowledge(3, acknowledged)
    ahead = min(sent, store.backlog)
    np.testing.assert_array_equal(store.beyond(ahead, most), store.fetch(most).values[ahead:])
