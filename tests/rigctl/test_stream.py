"""The stream fills the FIFO without overrunning it and counts every captured sample once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigctl.device import Fault, RigState
from rigctl.errors import TransportError
from rigctl.stream import Stream, StreamPlan
from rigctl.transport import NO_SEQUENCE, CaptureBlock, Reply, SetpointBlock
from sim_rig.fifo import CaptureStore, SetpointFifo


def a_plan(samples: int, *, block: int = 7, fifo: int = 64) -> StreamPlan:
    return StreamPlan(
        run_id=9,
        displacement_m=np.arange(samples, dtype=float),
        current_a=-np.arange(samples, dtype=float),
        block_samples=block,
        fifo_samples=fifo,
        prefill_samples=fifo // 4,
        high_water_samples=fifo * 3 // 4,
    )


class Rig:
    """The rig's side: the FIFO and capture store of the simulated rig, played sample by sample."""

    def __init__(self, fifo: int = 64) -> None:
        self.fifo, self.store = SetpointFifo(run_id=9, capacity=fifo), CaptureStore(run_id=9)
        self.played: list[float] = []

    def play(self, count: int) -> None:
        rows = self.fifo.peek(count)
        self.played.extend(rows[:, 0])
        self.store.append(np.column_stack([rows[:, 0]] * 5))
        self.fifo.drop(rows.shape[0])

    def answer(self, block: SetpointBlock | None, captured: int, most: int = 5) -> Reply:
        refused = block is not None and not self.fifo.accept(block)
        self.store.acknowledge(9, captured)
        return Reply(
            state=RigState.ACTIVE,
            faults=Fault.NONE,
            last_accepted=self.fifo.last_accepted,
            fifo_free=self.fifo.free,
            consumed=self.fifo.consumed,
            refused=refused,
            heartbeat=0,
            owned=True,
            capture=self.store.fetch(most),
        )


@settings(max_examples=150)
@given(st.integers(1, 300), st.integers(1, 20), st.data())
def test_whatever_the_wire_loses_or_doubles_every_sample_is_played_and_captured_once(
    samples: int, block: int, data: st.DataObject
) -> None:
    stream, rig, captured = Stream(a_plan(samples, block=block)), Rig(), []
    for turn in range(10_000):
        if stream.finished:
            break
        fate = data.draw(st.sampled_from(["good", "good", "lost up", "lost down", "doubled"])) if turn < 60 else "good"
        sent = stream.next_block()
        if fate == "lost up":
            stream.rewind()
            continue
        reply = rig.answer(sent, stream.captured)
        if fate == "doubled":
            reply = rig.answer(sent, stream.captured)
        rig.play(data.draw(st.integers(0, 30)) if turn < 60 else 30)
        if fate == "lost down":
            stream.rewind()
            continue
        fresh = stream.take(reply)
        if fresh is not None:
            assert fresh.first_index == len(captured)
            captured.extend(fresh.values[:, 0])
        assert rig.fifo.level <= 48 + block
    assert rig.played == captured == list(range(samples))
    assert rig.fifo.ended


@given(st.integers(1, 200), st.integers(1, 30))
def test_credits_never_exceed_the_high_water_mark_and_prefill_is_always_reachable(samples: int, block: int) -> None:
    stream = Stream(a_plan(samples, block=block))
    while (sent := stream.next_block()) is not None:
        stream.take(reply(sent.sequence))
        assert stream.plan.samples_before(stream.sent_blocks) <= 48
    assert stream.prefilled


def reply(accepted: int, consumed: int = 0, *, refused: bool = False, capture: CaptureBlock | None = None) -> Reply:
    nothing = CaptureBlock(run_id=9, first_index=0, values=np.empty((0, 5)))
    return Reply(
        state=RigState.HOLD,
        faults=Fault.NONE,
        last_accepted=accepted,
        fifo_free=0,
        consumed=consumed,
        refused=refused,
        heartbeat=0,
        owned=True,
        capture=capture or nothing,
    )


def test_sequence_numbers_wrap_without_a_gap() -> None:
    stream, rig = Stream(a_plan(70_000, block=1)), Rig()
    while not stream.finished:
        fresh = stream.take(rig.answer(stream.next_block(), stream.captured, most=50))
        rig.play(40)
        assert fresh is None or fresh.values[0, 0] == fresh.first_index
    assert rig.fifo.gaps == rig.fifo.duplicates == stream.resent_blocks == 0


def test_only_the_last_block_ends_the_stream() -> None:
    plan = a_plan(15)
    assert [plan.block(k).end_of_stream for k in range(plan.blocks)] == [False, False, True]
    assert [plan.block(k).samples for k in range(plan.blocks)] == [7, 7, 1]


def test_a_rig_that_acknowledges_what_was_never_sent_is_refused() -> None:
    stream = Stream(a_plan(30))
    stream.next_block()
    with pytest.raises(TransportError, match="never sent"):
        stream.take(reply(3))


def test_a_rig_that_played_more_than_it_was_given_is_refused() -> None:
    stream = Stream(a_plan(30))
    stream.next_block()
    with pytest.raises(TransportError, match="more than it was given"):
        stream.take(reply(0, consumed=8))


def test_a_rig_that_plays_a_block_of_which_it_has_a_part_is_not_refused() -> None:
    """A wire may divide a block into frames: the rig plays what it has, and the host counts whole blocks."""
    stream = Stream(a_plan(30))
    stream.next_block()
    assert stream.take(reply(NO_SEQUENCE, consumed=1)) is None
    assert stream.consumed == 1


def test_a_skipped_captured_sample_is_always_an_error() -> None:
    stream = Stream(a_plan(30))
    capture = CaptureBlock(run_id=9, first_index=2, values=np.zeros((3, 5)))
    with pytest.raises(TransportError, match=r"samples 0 … 1 are lost"):
        stream.take(reply(NO_SEQUENCE, capture=capture))


def test_captures_of_another_run_are_ignored() -> None:
    stream = Stream(a_plan(30))
    capture = CaptureBlock(run_id=8, first_index=0, values=np.zeros((3, 5)))
    assert stream.take(reply(NO_SEQUENCE, capture=capture)) is None
    assert stream.captured == 0


def test_a_foreign_run_a_gap_and_a_block_after_the_end_are_refused_and_a_repeat_is_dropped() -> None:
    fifo, plan = SetpointFifo(run_id=9), a_plan(10)
    assert not fifo.accept(a_block(plan, 0, run_id=8))
    assert not fifo.accept(plan.block(1))
    assert fifo.accept(plan.block(0))
    assert fifo.accept(plan.block(0))
    assert (fifo.level, fifo.duplicates, fifo.gaps) == (7, 1, 1)
    assert fifo.accept(plan.block(1))
    assert not fifo.accept(a_block(plan, 0, sequence=2))
    assert fifo.level == 10


def a_block(plan: StreamPlan, number: int, *, run_id: int = 9, sequence: int = 0) -> SetpointBlock:
    return SetpointBlock(
        run_id=run_id,
        sequence=sequence,
        displacement_m=plan.displacement_m[:7],
        current_a=plan.current_a[:7],
        end_of_stream=False,
    )


def test_a_full_fifo_refuses_and_takes_the_same_block_later() -> None:
    fifo, plan = SetpointFifo(run_id=9, capacity=10), a_plan(20)
    assert fifo.accept(plan.block(0))
    assert not fifo.accept(plan.block(1))
    fifo.drop(7)
    assert fifo.accept(plan.block(1))


def test_captured_samples_stay_until_they_are_acknowledged() -> None:
    store = CaptureStore(run_id=9)
    for start in range(0, 30, 4):
        store.append(np.repeat(np.arange(start, start + 4.0)[:, None], 5, axis=1))
    assert store.fetch(6).values[:, 0].tolist() == store.fetch(6).values[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    store.acknowledge(8, 5)
    store.acknowledge(9, 33)
    assert store.first_index == 0
    store.acknowledge(9, 6)
    store.acknowledge(9, 3)
    assert store.fetch(3).values[:, 0].tolist() == [6, 7, 8]
    assert (store.backlog, store.fetch(3).first_index) == (26, 6)
