"""The host counts accepted blocks and set-points as the rig does, whichever frames the rig accepts."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rigctl.can_blocks import BlockCount
from rigctl.transport import NO_SEQUENCE, SEQUENCES, SetpointBlock


def a_block(number: int, samples: int) -> SetpointBlock:
    return SetpointBlock(
        run_id=1,
        sequence=number,
        displacement_m=np.zeros(samples),
        current_a=np.zeros(samples),
        end_of_stream=False,
    )


@given(st.integers(1, 20), st.integers(1, 12), st.integers(1, 40), st.integers(0, 200), st.data())
def test_a_block_counts_once_all_of_its_units_are_there(
    units: int, unit_samples: int, blocks: int, short: int, data: st.DataObject
) -> None:
    count = BlockCount(units=units, unit_samples=unit_samples)
    last = max(units * unit_samples - short, 1)
    sizes = [units * unit_samples] * (blocks - 1) + [last]
    accepted, before = 0, 0
    for number, size in enumerate(sizes):
        block, due = a_block(number, size), -(-size // unit_samples)
        assert count.first_unit(block) == number * units
        got = data.draw(st.integers(0, due))
        for have in (got, due):  # a part, and after it was sent again all of it
            count.note((accepted + have - 1) % SEQUENCES)
            assert count.samples == before + min(have * unit_samples, size)
            assert count.has(block) == (have == due)
            count.first_unit(block)
            count.note((accepted + have - 1) % SEQUENCES)
        accepted, before = accepted + due, before + size
        assert count.last_block == number


def test_unit_numbers_wrap_without_a_gap() -> None:
    count = BlockCount(units=16, unit_samples=9)
    assert count.last_block == NO_SEQUENCE
    for number in range(9000):
        block = a_block(number, 144)
        first = count.first_unit(block)
        assert not count.has(block)
        count.note((first + 15) % SEQUENCES)
        assert count.has(block)
        assert (count.last_block, count.samples) == (number % SEQUENCES, 144 * (number + 1))
    count.note((first + 15) % SEQUENCES)
    assert count.samples == 144 * 9000
