"""The packed frames agree with the DBC files, and a damaged frame is never decoded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rigctl
from rigctl import can_frames as frames
from rigctl import can_further, scaling
from rigctl.bus_load import bus_load, check_bus
from rigctl.device import Fault, PressureStage
from rigctl.errors import LimitError
from rigctl.further_axes import FURTHER_AXES

FOLDER = Path(rigctl.__file__).parent
CLASSIC: Any = cantools.database.load_file(FOLDER / "damper_rig.dbc")
FD: Any = cantools.database.load_file(FOLDER / "damper_rig_fd.dbc")

count32, count16 = st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1)
set_points = st.lists(st.tuples(count32, count16), min_size=1, max_size=frames.FD_BLOCK)
samples = st.lists(
    st.tuples(count32, count32, count16, count16, st.integers(0, 2**16 - 1)), min_size=1, max_size=frames.FD_CAPTURE
)
SESSION, RUN = 0xA5C3, 77
u16, run_ids = st.integers(0, 2**16 - 1), st.integers(1, 2**16 - 1)


def si(rows: list[tuple[int, ...]], lsb: tuple[float, ...]) -> np.ndarray:
    return np.array(rows, dtype=float) * np.array(lsb)


def test_the_crc_is_that_of_sae_j1850() -> None:
    assert frames.crc8(b"123456789") == 0x4B


@given(st.integers(0, 15), u16, u16, u16, st.integers(0, 63), st.integers(1, 255))
def test_control_frames_agree_with_the_dbc_and_survive_no_damage(
    control: int, session: int, run_id: int, number: int, where: int, change: int
) -> None:
    order = frames.ControlFrame(control=control, session=session, run_id=run_id, number=number)
    data = order.pack()
    decoded = CLASSIC.decode_message("control", data)
    names = ("control_word", "mode", "session", "run_id", "number")
    assert [decoded[name] for name in names] == [control, 0, session, run_id, number]
    assert frames.unpack_control(data) == order
    damaged = bytearray(data)
    damaged[where % 8] ^= change
    assert frames.unpack_control(bytes(damaged)) is None


@given(u16, u16, count32, count16, st.integers(0, 63), st.integers(1, 255))
def test_a_command_to_travel_is_good_only_with_its_own_direct_set_point(
    session: int, number: int, position: int, current: int, where: int, change: int
) -> None:
    direct = frames.pack_direct(position * scaling.DISPLACEMENT_M, current * scaling.CURRENT_A, number)
    order = frames.ControlFrame(control=3, mode=frames.MODE_TRAVEL, session=session, run_id=0, number=number)
    data = order.pack(direct)
    assert frames.unpack_control(data, direct) == order
    damaged = bytearray(direct)
    damaged[where % 8] ^= change
    assert frames.unpack_control(data, bytes(damaged)) is None


@given(u16, u16, st.integers(0, 4), st.integers(1, 255))
def test_a_hosts_heartbeat_agrees_with_the_dbc(session: int, number: int, where: int, change: int) -> None:
    data = frames.pack_host_heartbeat(session, number)
    decoded = CLASSIC.decode_message("host_heartbeat", data)
    assert (decoded["session"], decoded["number"]) == (session, number)
    assert frames.unpack_host_heartbeat(data) == (session, number)
    assert frames.unpack_host_heartbeat(data[:1]) is None


@given(st.integers(0, 2**31), u16, st.booleans(), st.integers(-(2**23), 2**23 - 1))
def test_an_acknowledgement_means_its_own_run_and_the_nearest_count(
    captured: int, run_id: int, again: bool, off: int
) -> None:
    word = frames.captured_word(captured, run_id, again=again)
    assert frames.captured_from(word, run_id, captured - off) == captured
    assert frames.captured_from(word, run_id + 1, captured) is None
    assert bool(word & frames.AGAIN) == again


@given(
    st.integers(0, 15),
    st.booleans(),
    st.booleans(),
    u16,
    u16,
    u16,
    st.integers(0, 15),
    st.integers(0, 15),
    st.sampled_from(PressureStage),
)
def test_status_frames_agree_with_the_dbc(
    state: int,
    arrived: bool,
    refused: bool,
    faults: int,
    level: int,
    accepted: int,
    session: int,
    run_id: int,
    stage: PressureStage,
) -> None:
    status = frames.StatusFrame(
        state=state,
        arrived=arrived,
        refused=refused,
        faults=faults,
        fifo_level=level,
        last_accepted=accepted,
        session=session,
        run_id=run_id,
        stage=stage,
    )
    data = frames.pack_status(status)
    assert frames.unpack_status(data) == status
    decoded = CLASSIC.decode_message("status", data)
    assert (decoded["state"], decoded["fault_word"], decoded["last_accepted"]) == (state, faults, accepted)
    assert (decoded["session"], decoded["run"], decoded["pressure_stage"]) == (session, run_id, stage.value)


@given(st.sampled_from([*Fault]), st.integers(0, 2**32 - 1))
def test_emergency_frames_agree_with_the_dbc_and_name_the_fault(fault: Fault, index: int) -> None:
    decoded = CLASSIC.decode_message("emergency", frames.pack_emergency(fault, index))
    assert (1 << decoded["fault_bit"], decoded["sample_index"]) == (fault, index)
    assert decoded["code"] != 0
    assert CLASSIC.decode_message("emergency", frames.pack_emergency(Fault.NONE, index))["code"] == 0


@pytest.mark.parametrize("table", [CLASSIC, FD])
def test_every_identifier_of_the_dbc_is_the_one_on_the_wire(table: Any) -> None:
    ids = {message.name: message.frame_id for message in table.messages}
    assert (ids["nmt"], ids["emergency"]) == (frames.NMT, frames.EMERGENCY)
    assert (ids["rig_heartbeat"], ids["host_heartbeat"]) == (frames.RIG_HEARTBEAT, frames.HOST_HEARTBEAT)
    assert (ids["control"], ids["status"], ids["health"]) == (frames.CONTROL, frames.STATUS, frames.HEALTH)


@given(count32, count16, u16)
def test_direct_and_health_frames_agree_with_the_dbc(position: int, small: int, number: int) -> None:
    data = frames.pack_direct(position * scaling.DISPLACEMENT_M, small * scaling.CURRENT_A, number)
    decoded = CLASSIC.decode_message("direct", data)
    assert decoded["displacement"] == pytest.approx(position * 1e-7, abs=1e-12)
    assert decoded["current"] == pytest.approx(small * 1e-4, abs=1e-9)
    data = frames.pack_health(small * 0.1, number * 1e4, number)
    decoded = CLASSIC.decode_message("health", data)
    assert decoded["temperature"] == pytest.approx(small * 0.1)
    assert (decoded["supply_pressure"], decoded["consumed"]) == (number * 1e4, number)


@given(set_points, u16, run_ids, st.booleans(), st.integers(0, 999), st.integers(1, 255))
def test_classic_set_points_agree_with_the_dbc_and_survive_no_damage(
    rows: list[tuple[int, int]], sequence: int, run_id: int, end: bool, where: int, change: int
) -> None:
    values = si(rows, scaling.SETPOINT)
    *stream, (identifier, commit) = frames.pack_stream(values, sequence, run_id, end, session=SESSION)
    assert identifier == frames.COMMIT
    for k, (number, data) in enumerate(stream):
        decoded = CLASSIC.decode_message(number, data)
        assert decoded["number"] == k
        assert decoded["displacement"] == pytest.approx(values[k, 0], abs=1e-12)
    parts = {k: data[2:] for k, (_, data) in enumerate(stream)}
    found = frames.unpack_stream(parts, commit, run_id, session=SESSION, following=sequence)
    assert found is not None
    np.testing.assert_allclose(found[0], values, rtol=0, atol=1e-12)
    assert found[1:] == (sequence, end)
    assert frames.unpack_stream(parts, commit, run_id ^ 1, session=SESSION, following=sequence) is None
    assert frames.unpack_stream(parts, commit, run_id, session=SESSION ^ 1, following=sequence) is None
    lost = dict(parts)
    del lost[where % len(lost)]
    assert frames.unpack_stream(lost, commit, run_id, session=SESSION, following=sequence) is None
    damaged = bytearray(parts[0])
    damaged[where % 6] ^= change
    spoilt = {**parts, 0: bytes(damaged)}
    assert frames.unpack_stream(spoilt, commit, run_id, session=SESSION, following=sequence) is None
    late = frames.pack_stream(values, sequence + 65536, run_id, end, session=SESSION)[-1][1]
    assert frames.unpack_stream(parts, late, run_id, session=SESSION, following=sequence) is None
    assert frames.unpack_stream(parts, commit, run_id, session=SESSION, following=sequence + 65536) is None


@given(set_points, u16, run_ids, st.booleans(), st.integers(0, 999), st.integers(1, 255))
def test_fd_set_points_agree_with_the_dbc_and_survive_no_damage(
    rows: list[tuple[int, int]], sequence: int, run_id: int, end: bool, where: int, change: int
) -> None:
    values = si(rows, scaling.SETPOINT)
    [(_, data)] = frames.pack_stream_fd(values, sequence, run_id, end, session=SESSION)
    decoded = FD.decode_message(frames.STREAM, data)
    assert (decoded["sequence"], decoded["count"], decoded["last"], decoded["run_id"]) == (
        sequence,
        len(rows),
        end,
        run_id,
    )
    assert [decoded[f"current_{k}"] for k in range(len(rows))] == pytest.approx(values[:, 1].tolist(), abs=1e-9)
    found = frames.unpack_stream_fd(data, following=sequence)
    assert found is not None
    np.testing.assert_allclose(found.rows, values, rtol=0, atol=1e-12)
    assert (found.sequence, found.run_id, found.session, found.end) == (sequence, run_id, SESSION, end)
    assert decoded["session"] == SESSION
    damaged = bytearray(data)
    damaged[where % 64] ^= change
    assert frames.unpack_stream_fd(bytes(damaged), following=sequence) is None
    assert frames.unpack_stream_fd(data, following=sequence + 65536) is None, "65 536 frames late"


@given(st.integers(1, 40), u16, st.booleans())
def test_a_block_of_several_frames_is_the_same_samples_in_order(n: int, sequence: int, end: bool) -> None:
    values = si([(k, -k) for k in range(n)], scaling.SETPOINT)
    found = [
        frames.unpack_stream_fd(data, following=sequence)
        for _, data in frames.pack_stream_fd(values, sequence, 7, end, session=SESSION)
    ]
    np.testing.assert_allclose(np.concatenate([one.rows for one in found if one is not None]), values, atol=1e-12)
    assert [one.sequence for one in found if one is not None] == [sequence + k for k in range(-(-n // 9))]
    assert [one.end for one in found if one is not None] == [False] * (len(found) - 1) + [end]
    captured = si([(k,) * 5 for k in range(n)], scaling.CAPTURE)
    again = [
        frames.unpack_capture_fd(data, run_id=RUN) for _, data in frames.pack_capture_fd(captured, sequence, run_id=RUN)
    ]
    np.testing.assert_array_equal([one[0] for one in again if one is not None], range(sequence, sequence + n, 4))
    assert sum(one[1].shape[0] for one in again if one is not None) == n


@given(samples, st.integers(0, 2**32 - 1), st.integers(0, 999), st.integers(1, 255))
def test_captured_samples_agree_with_the_dbc_and_survive_no_damage(
    rows: list[tuple[int, ...]], first: int, where: int, change: int
) -> None:
    values = si(rows, scaling.CAPTURE)
    [(_, data)] = frames.pack_capture_fd(values, first, run_id=RUN)
    decoded = FD.decode_message(frames.CAPTURE, data)
    assert (decoded["first_index"], decoded["count"]) == (first, len(rows))
    assert [decoded[f"force_{k}"] for k in range(len(rows))] == pytest.approx(values[:, 0].tolist())
    found = frames.unpack_capture_fd(data, run_id=RUN)
    assert found is not None
    assert found[0] == first
    np.testing.assert_allclose(found[1], values, rtol=1e-12, atol=1e-12)
    damaged = bytearray(data)
    damaged[where % 64] ^= change
    assert frames.unpack_capture_fd(bytes(damaged), run_id=RUN) is None
    assert frames.unpack_capture_fd(data, run_id=RUN + 1) is None
    classic = frames.pack_capture(values, first, run_id=RUN)
    for k in range(len(rows)):
        (a, data_a), (b, data_b) = classic[2 * k : 2 * k + 2]
        assert CLASSIC.decode_message(a, data_a)["force"] == pytest.approx(values[k, 0])
        assert CLASSIC.decode_message(b, data_b)["displacement"] == pytest.approx(values[k, 1], abs=1e-12)
        sample = frames.unpack_capture(data_a, data_b, values[k, 4], run_id=RUN, following=first + 1)
        assert sample is not None
        assert sample[0] == first + k
        np.testing.assert_allclose(sample[1], values[k : k + 1], rtol=1e-12, atol=1e-12)
        assert frames.unpack_capture(data_a, data_b, 0.0, run_id=RUN + 1, following=first) is None
    if len(rows) > 1:
        assert frames.unpack_capture(classic[0][1], classic[3][1], 0.0, run_id=RUN, following=first) is None


count24 = st.integers(-(2**23), 2**23 - 1)


@given(st.lists(st.tuples(*10 * (count24,)), min_size=1, max_size=2), st.integers(0, 2**31), st.integers(0, 63), u16)
def test_channels_of_further_axes_agree_with_the_dbc_and_survive_no_damage(
    rows: list[tuple[int, ...]], first: int, where: int, change: int
) -> None:
    values = si(rows, scaling.FURTHER)
    [(number, data)] = can_further.pack_further_fd(values, first, run_id=RUN)
    decoded = FD.decode_message(number, data)
    for k, row in enumerate(values):
        assert [decoded[f"{name}_{k}"] for name in FURTHER_AXES] == pytest.approx(row.tolist(), abs=1e-9)
    found = can_further.unpack_further_fd(data, run_id=RUN, following=first + 9)
    assert found is not None
    assert found[0] == first
    np.testing.assert_allclose(found[1], values, rtol=1e-12, atol=1e-12)
    damaged = bytearray(data)
    damaged[where] ^= change % 255 + 1
    assert can_further.unpack_further_fd(bytes(damaged), run_id=RUN, following=first) is None
    assert can_further.unpack_further_fd(data, run_id=RUN + 1, following=first) is None
    frames_of = can_further.pack_further(values, first, run_id=RUN)
    parts = dict(frames_of[:5])
    shown = {name: value for part in parts.items() for name, value in CLASSIC.decode_message(*part).items()}
    assert [shown[name] for name in FURTHER_AXES] == pytest.approx(values[0].tolist(), abs=1e-9)
    sample = can_further.unpack_further(parts, run_id=RUN, following=first + 1)
    assert sample is not None
    assert sample[0] == first
    np.testing.assert_allclose(sample[1], values[:1], rtol=1e-12, atol=1e-12)
    assert can_further.unpack_further(parts, run_id=RUN + 1, following=first) is None
    if len(rows) > 1:
        mixed = parts | dict(frames_of[5:6])
        assert can_further.unpack_further(mixed, run_id=RUN, following=first) is None


def test_a_channel_of_a_further_axis_that_does_not_fit_is_refused() -> None:
    with pytest.raises(OverflowError, match="does not fit 24 bits"):
        can_further.pack_further(np.full((1, 10), 1.0), 0, run_id=RUN)


def test_a_plan_that_the_bus_cannot_carry_is_refused() -> None:
    def classic(rate: float) -> float:
        return bus_load(rate, fd=False, bitrate=1e6, data_bitrate=5e6)

    def flexible(rate: float) -> float:
        return bus_load(rate, fd=True, bitrate=1e6, data_bitrate=5e6)

    assert classic(1000) == pytest.approx(0.43, abs=0.01)
    assert classic(2000) == pytest.approx(0.84, abs=0.01)
    assert flexible(1000) < 0.1
    assert 0.25 < flexible(5000) < 0.4
    check_bus(1000, fd=False, bitrate=1e6, data_bitrate=5e6)
    check_bus(5000, fd=True, bitrate=1e6, data_bitrate=5e6)
    with pytest.raises(LimitError, match=r"2000 Hz loads the bus to 84 %.*CAN FD"):
        check_bus(2000, fd=False, bitrate=1e6, data_bitrate=5e6)


def test_the_channels_of_further_axes_load_the_bus_too() -> None:
    def load(rate: float, *, fd: bool) -> float:
        return bus_load(rate, fd=fd, bitrate=1e6, data_bitrate=5e6, further_axes=True)

    assert load(500, fd=False) == pytest.approx(0.56, abs=0.01)
    assert load(1000, fd=True) == pytest.approx(0.16, abs=0.02)
    with pytest.raises(LimitError, match=r"1000 Hz loads the bus to 111 %.*CAN FD"):
        check_bus(1000, fd=False, bitrate=1e6, data_bitrate=5e6, further_axes=True)
