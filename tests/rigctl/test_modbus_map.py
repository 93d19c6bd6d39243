"""The register map is one table that both sides read the same way."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigctl import modbus_further, scaling
from rigctl import modbus_map as table
from rigctl.limits import Configuration, Limits
from rigctl.transport import CaptureBlock, SetpointBlock

BLOCKS = (
    *table.INPUT_BLOCKS,
    *table.COMMAND_BLOCKS,
    table.CONFIGURATION,
    table.WRITE_HEADER,
    table.READ_HEADER,
    *modbus_further.HEADERS,
)


def test_no_two_registers_share_a_word_and_every_one_lies_in_its_block() -> None:
    for block in BLOCKS:
        ordered = sorted(block.registers, key=lambda register: register.address)
        for one, other in itertools.pairwise(ordered):
            assert one.end <= other.address, (one.name, other.name)
        assert block.address <= ordered[0].address
        assert ordered[-1].end <= block.address + block.count


def test_no_two_blocks_overlap_and_every_window_fits_one_transaction() -> None:
    for one, other in itertools.pairwise(sorted(BLOCKS, key=lambda block: block.address)):
        assert one.address + one.count <= other.address
    assert table.WRITE_COUNT <= 121
    assert table.READ_COUNT <= 125
    assert table.WRITE_HEADER.address + table.WRITE_COUNT <= table.READ_HEADER.address
    assert table.READ_HEADER.address + table.READ_COUNT <= modbus_further.HEADERS[0].address
    assert modbus_further.COUNT <= 125
    for one, other in itertools.pairwise(modbus_further.HEADERS):
        assert one.address + modbus_further.COUNT <= other.address


@given(st.data())
def test_every_register_decodes_what_it_encoded(data: st.DataObject) -> None:
    for block in BLOCKS:
        values: dict[str, table.Value] = {}
        for register in block.registers:
            if register.type == "text":
                values[register.name] = data.draw(
                    st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=12)
                )
                continue
            bits = 16 if register.type in ("u16", "i16") else 32
            low, high = (0, 2**bits - 1) if register.type[0] == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
            values[register.name] = data.draw(st.integers(low, high)) * register.scale
        words = block.encode(values)
        assert len(words) == block.count
        assert all(0 <= word <= 0xFFFF for word in words)
        assert block.decode(words) == pytest.approx(values)


def test_a_value_that_does_not_fit_is_refused() -> None:
    values = dict.fromkeys((register.name for register in table.CONTROL.registers), 0.0)
    with pytest.raises(OverflowError):
        table.CONTROL.encode({**values, "run_id": 70_000})
    block = SetpointBlock(
        run_id=1, sequence=0, displacement_m=np.array([1e6]), current_a=np.zeros(1), end_of_stream=False
    )
    with pytest.raises(OverflowError, match="displacement"):
        table.encode_write(block, 1, 0, session=9, heartbeat=0)


def counts(low: int, high: int) -> st.SearchStrategy[float]:
    return st.integers(low, high).map(float)


@given(
    st.lists(st.tuples(counts(-(2**31), 2**31 - 1), counts(-(2**15), 2**15 - 1)), max_size=table.BLOCK_SAMPLES),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_set_points_cross_the_wire_to_the_count(rows: list[tuple[float, float]], last: bool, captured: int) -> None:
    values = np.array(rows).reshape(-1, 2) * np.array(scaling.SETPOINT)
    block = SetpointBlock(
        run_id=7, sequence=65535, displacement_m=values[:, 0], current_a=values[:, 1], end_of_stream=last
    )
    words = table.encode_write(block if rows else None, 7, captured, session=9, heartbeat=3)
    assert len(words) <= table.WRITE_COUNT
    window = table.decode_write(words, following=65534)
    assert window is not None
    assert (window.run_id, window.session, window.captured, window.heartbeat) == (7, 9, captured, 3)
    if rows:
        assert window.block is not None
        np.testing.assert_allclose(window.block.displacement_m, values[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(window.block.current_a, values[:, 1], rtol=0, atol=1e-12)
        assert (window.block.sequence, window.block.end_of_stream) == (65535, last)


HEAD: dict[str, table.Value] = {
    "state": 15,
    "faults": 0,
    "last_accepted": 4,
    "fifo_free": 9,
    "consumed": 70_000,
    "session": 9,
}


@given(st.integers(0, table.CAPTURE_SAMPLES), st.integers(0, 2**32 - 1), st.booleans(), st.integers(0, 999))
def test_captured_samples_cross_the_wire_within_half_a_count(count: int, first: int, refused: bool, seed: int) -> None:
    random = np.random.default_rng(seed)
    values = random.uniform(0, 1, (count, 5)) * np.array([2e4, 0.1, 2.0, 80.0, 2e7])
    words = table.encode_read(HEAD, CaptureBlock(run_id=7, first_index=first, values=values), refused)
    assert len(words) == table.READ_COUNT
    opened = table.decode_read(words)
    assert opened is not None
    head, capture, said = opened
    assert (head["consumed"], capture.first_index, capture.samples, said) == (70_000, first, count, refused)
    assert np.all(np.abs(capture.values - values) <= 0.5001 * np.array(scaling.CAPTURE))


@given(st.integers(0, 10_000), st.integers(1, 0xFFFF))
def test_one_changed_word_of_a_window_is_always_detected(where: int, change: int) -> None:
    values = np.ones((table.CAPTURE_SAMPLES, 5))
    words = table.encode_read(HEAD, CaptureBlock(run_id=7, first_index=3, values=values), False)
    words[where % len(words)] ^= change
    assert table.decode_read(words) is None
    block = SetpointBlock(run_id=7, sequence=1, displacement_m=np.ones(5), current_a=np.ones(5), end_of_stream=False)
    words = table.encode_write(block, 7, 0, session=9, heartbeat=0)
    words[where % len(words)] ^= change
    assert table.decode_write(words, following=1) is None


def test_a_configuration_comes_back_from_its_registers() -> None:
    configuration = Configuration(sample_rate_hz=512.5, limits=Limits(force_n=1234.5, position_min_m=-0.0123))
    words = table.CONFIGURATION.encode(table.configuration_values(configuration))
    assert table.configuration_from(table.CONFIGURATION.decode(words)) == configuration


@given(st.integers(0, table.CAPTURE_SAMPLES), st.integers(0, 2**31), st.integers(0, 999), st.integers(1, 0xFFFF))
def test_channels_of_further_axes_cross_in_windows_and_survive_no_damage(
    count: int, first: int, where: int, change: int
) -> None:
    random = np.random.default_rng(where)
    values = np.hstack([np.ones((count, 5)), random.uniform(-1, 1, (count, 10)) * 1e5 * np.array(scaling.FURTHER)])
    whole = CaptureBlock(run_id=7, first_index=first, values=values)
    words = [modbus_further.encode_further(k, whole) for k in range(len(modbus_further.HEADERS))]
    windows = [modbus_further.decode_further(k, one) for k, one in enumerate(words)]
    some = CaptureBlock(run_id=7, first_index=first, values=values[:, :5])
    joined = modbus_further.with_further(some, windows)
    assert joined is not None
    assert np.all(np.abs(joined.values - values)[:, 5:] <= 0.5001 * np.array(scaling.FURTHER))
    later = CaptureBlock(run_id=7, first_index=first + 1, values=values[:, :5])
    assert modbus_further.with_further(later, windows) is None
    used = 6 + 20 * min(count, modbus_further.SAMPLES)
    words[0][where % used] ^= change
    assert modbus_further.decode_further(0, words[0]) is None
