"""One contract for every wire to a rig: the same suite without a wire and over a real process."""

from __future__ import annotations

import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.plan import Test
from rigctl.address import connect
from rigctl.clock import SystemClock
from rigctl.device import Control, PressureStage, RigState
from rigctl.errors import IdentityError, RequestDenied, RigError, TransportError, UrlError
from rigctl.limits import JOG_S, Configuration, Limits
from rigctl.modbus_map import IDENTITY
from rigctl.modbus_wire import ModbusTransport
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.transport import SetpointBlock, Transport
from sim_rig.direct import DirectTransport
from tests.sim_rig.virtual import NullModem

S = 2.0


@pytest.fixture(params=["direct", "modbus", "can", "can_fd"])
def wire(request: pytest.FixtureRequest, bench: Callable[..., Any]) -> Iterator[Transport]:
    if request.param == "direct":
        b = bench(speed=50.0)
        transport: Transport = DirectTransport(b.rig, b.clock)
    else:
        transport = connect(request.getfixturevalue(f"{request.param}_rig"))
    transport.identify(S)
    transport.claim(S)
    yield transport
    for _ in range(200):
        if transport.stop(S).state is RigState.DISABLED:
            break
        transport.claim(S)
        transport.status(S)
    transport.close()


def a_block(wire: Transport, run_id: int, sequence: int, *, end: bool = False) -> SetpointBlock:
    n = wire.block_samples
    return SetpointBlock(
        run_id=run_id,
        sequence=sequence,
        displacement_m=np.zeros(n),
        current_a=np.full(n, 0.5),
        end_of_stream=end,
    )


def test_the_rig_says_who_it_is(wire: Transport) -> None:
    identity = wire.identify(S)
    assert (identity.vendor, identity.model, identity.map_version) == ("damper-rig", "sim_rig", 3)
    assert identity.channel_count == 5
    assert identity.limits.position_max_m > 0.05
    assert identity == wire.identify(S)


def test_a_configuration_is_kept_or_refused_and_never_changed(wire: Transport) -> None:
    wire.configure(Configuration(limits=Limits(force_n=5e3)), S)
    wire.configure(Configuration(limits=Limits(force_n=5e3)), S)
    with pytest.raises(RequestDenied):
        wire.configure(Configuration(limits=Limits(force_n=1e6)), S)
    wire.command(Control.HOLD, 1, S)
    with pytest.raises(RequestDenied):
        wire.configure(Configuration(), S)


def test_a_command_may_be_repeated(wire: Transport) -> None:
    for _ in range(2):
        assert wire.command(Control.DISABLE, 7, S).state is RigState.DISABLED
    for _ in range(2):
        assert wire.command(Control.HOLD, 7, S).state is RigState.HOLD


def test_the_hold_set_point_travels_to_where_it_is_sent(wire: Transport) -> None:
    with pytest.raises(RequestDenied):
        wire.direct(0.01, 0.3, S)
    wire.command(Control.HOLD, 8, S)
    with pytest.raises(RequestDenied):
        wire.direct(0.5, 0.3, S)
    wire.direct(0.01, 0.3, S)
    ends = time.monotonic() + 60
    while not (status := wire.status(S)).arrived:
        assert time.monotonic() < ends
    assert status.displacement_m == pytest.approx(0.01, abs=5e-4)
    assert status.current_a == pytest.approx(0.3, abs=0.01)
    wire.direct(0.0, 0.0, S)
    while not wire.status(S).arrived:
        assert time.monotonic() < ends


def low(wire: Transport) -> Configuration:
    """The widest configuration that the rig takes at low pressure."""
    identity = wire.identify(S)
    assert identity.low_pressure is not None
    return Configuration(limits=identity.low_pressure.within(identity.limits), stage=PressureStage.LOW)


def test_at_low_pressure_the_piston_moves_only_while_somebody_asks_for_it(wire: Transport) -> None:
    with pytest.raises(RequestDenied):
        wire.configure(replace(low(wire), limits=wire.identify(S).limits), S)
    wire.configure(low(wire), S)
    assert wire.status(S).stage is PressureStage.OFF
    start = wire.status(S).displacement_m
    assert wire.command(Control.HOLD, 9, S).stage is PressureStage.LOW
    with pytest.raises(RequestDenied):
        wire.direct(0.01, 0.3, S)
    ends = time.monotonic() + 60
    while wire.jog(start + 0.02, S).displacement_m < start + 0.003:
        assert time.monotonic() < ends
        wire.status(S)
    while not (status := wire.status(S)).arrived:  # nobody asks any more
        assert time.monotonic() < ends
    assert start + 0.003 <= status.displacement_m < start + 0.003 + 2 * 0.01 * (JOG_S + 0.1)
    assert status.state is RigState.HOLD
    for _ in range(10):
        assert wire.status(S).displacement_m == pytest.approx(status.displacement_m, abs=5e-5)
    while not (status := wire.jog(start, S)).arrived or abs(status.displacement_m - start) > 1e-3:
        assert time.monotonic() < ends
        wire.status(S)


def test_no_run_is_played_at_low_pressure_and_no_jog_moves_at_high_pressure(wire: Transport) -> None:
    wire.configure(low(wire), S)
    wire.command(Control.HOLD, 10, S)
    wire.exchange(a_block(wire, 10, 0, end=True), 10, 0, S)
    with pytest.raises(RequestDenied):
        wire.command(Control.ACTIVATE, 10, S)
    while wire.command(Control.DISABLE, 10, S).state is not RigState.DISABLED:
        wire.status(S)
    wire.configure(Configuration(), S)
    assert wire.command(Control.HOLD, 11, S).stage is PressureStage.HIGH
    with pytest.raises(RequestDenied):
        wire.jog(0.001, S)


def test_a_stream_with_every_block_sent_twice_is_played_once_and_captured_whole(wire: Transport) -> None:
    run = 4321
    wire.configure(Configuration(), S)
    blocks = max(1200 // wire.block_samples, 2)
    wire.command(Control.HOLD, run, S)
    for number in range(blocks):
        block = a_block(wire, run, number, end=number == blocks - 1)
        for _ in range(2):
            reply = wire.exchange(block, run, 0, S)
            assert (reply.last_accepted, reply.refused) == (number, False)
    wire.command(Control.ACTIVATE, run, S)
    captured, ends = 0, time.monotonic() + 60
    while captured < blocks * wire.block_samples:
        assert time.monotonic() < ends
        first = wire.exchange(None, run, captured, S)
        again = wire.exchange(None, run, captured, S)
        n = first.capture.samples
        assert first.capture.first_index == again.capture.first_index == captured
        np.testing.assert_array_equal(first.capture.values, again.capture.values[:n])
        captured += n
    assert wire.status(S).consumed == blocks * wire.block_samples
    assert wire.status(S).state is RigState.HOLD


def test_a_gap_and_a_foreign_run_are_refused_with_the_number_to_go_back_to(wire: Transport) -> None:
    run = 4322
    wire.command(Control.HOLD, run, S)
    wire.exchange(a_block(wire, run, 0), run, 0, S)
    for block in (a_block(wire, run, 2), a_block(wire, 99, 1)):
        reply = wire.exchange(block, block.run_id, 0, S)
        assert reply.refused
        assert reply.last_accepted == 0 or block.run_id != run, "an acknowledgement belongs to a run"


def test_closing_twice_is_harmless(wire: Transport) -> None:
    wire.close()
    wire.close()


@pytest.mark.parametrize("rig", ["modbus_rig", "can_rig", "can_fd_rig"])
def test_a_test_over_a_wire_is_recorded_whole(
    request: pytest.FixtureRequest, rig: str, a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    with closing(connect(request.getfixturevalue(rig))) as wire:
        path = play(wire, a_sine(2000), tmp_path, settings=PlayerSettings(ramp_s=0.2))
    run = read_run(path)
    assert (run.status, run.samples) == ("complete", 2000)
    error = run.channels["displacement"] - run.channels["displacement_command"]
    assert np.std(error) < 0.1 * np.std(run.channels["displacement"])


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_rigs_process_ends_cleanly_on_a_signal(start_rig: Callable[..., Any], number: signal.Signals) -> None:
    with start_rig("modbus://127.0.0.1:0", 1.0) as (process, _):
        process.send_signal(number)
        assert process.wait(60) == 0


def test_a_rig_that_dies_in_a_run_leaves_a_truncated_file(
    start_rig: Callable[..., Any], a_sine: Callable[..., Test], tmp_path: Path
) -> None:
    with start_rig("modbus://127.0.0.1:0", 1.0) as (process, url):
        began = time.monotonic()
        with closing(connect(url)) as wire, pytest.raises(RigError, match=r"connect|acknowledged") as caught:
            play(
                wire,
                a_sine(60_000),
                tmp_path,
                on_progress=lambda p: process.kill() if p.samples > 500 else None,
                settings=PlayerSettings(ramp_s=0.2, link_patience_s=0.5),
            )
        assert time.monotonic() - began < 60
    assert caught.value.run_path is not None
    run = read_run(caught.value.run_path)
    assert run.status == "truncated"
    assert run.samples > 500


def test_an_address_without_a_rig_is_an_error_in_time() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # and nobody listens there
        url = f"modbus://127.0.0.1:{taken.getsockname()[1]}"
        took_s = []
        for _ in range(3):
            began = time.monotonic()
            with closing(connect(url)) as wire, pytest.raises(TransportError):
                wire.identify(0.3)
            took_s.append(time.monotonic() - began)
    assert min(took_s) < 2  # the others may wait for a busy computer


def test_a_rig_that_never_answers_is_a_time_out_at_the_deadline() -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        took_s = []
        for _ in range(3):
            transport = connect(f"modbus://127.0.0.1:{silent.getsockname()[1]}", clock=SystemClock())
            began = time.monotonic()
            with closing(transport), pytest.raises(TransportError):
                transport.identify(0.4)
            took_s.append(time.monotonic() - began)
    assert 0.3 < min(took_s) < 2  # the others may wait for a busy computer


class OtherDevice(NullModem):
    """A device with another word in one register of its identity."""

    def __init__(self, bench: Any, register: str) -> None:
        super().__init__(bench.rig, bench.clock)
        self._at = [r.name for r in IDENTITY.registers].index(register)  # each of the first two is one word

    def serve(self, request: bytes) -> bytes:
        answer = bytearray(super().serve(request))
        answer[9 + 2 * self._at : 11 + 2 * self._at] = b"\x00\x77"  # after the header, function and count
        return bytes(answer)


@pytest.mark.parametrize(
    ("register", "words"), [("magic", "a foreign device: magic is 0x0077"), ("map_version", "register map 119")]
)
def test_a_foreign_device_and_another_map_are_refused_without_motion(
    bench: Callable[..., Any], register: str, words: str
) -> None:
    b = bench(speed=1.0)
    wire = ModbusTransport("virtual", 502, clock=b.clock, client=OtherDevice(b, register))
    with pytest.raises(IdentityError, match=words) as caught:
        wire.identify(S)
    assert "\n" not in str(caught.value)
    assert b.rig.controller.state is RigState.DISABLED
    assert not b.plant.commands or not np.any(np.concatenate(b.plant.commands))


@pytest.mark.parametrize(
    "url",
    ["", "modbus://", "modbus://host", "modbus://host:port", "modbus://h:70000", "http://h:1", "modbus://h:1/x", "rig"],
)
def test_a_wrong_address_is_refused_in_one_line_that_shows_the_right_form(url: str) -> None:
    with pytest.raises(UrlError, match="modbus://HOST:PORT") as caught:
        connect(url)
    assert "\n" not in str(caught.value)
