"""A heartbeat that has stopped is noticed; answers that a busy computer delays are not taken for it."""

from __future__ import annotations

import numpy as np
import pytest

from rigctl.axis import Axis
from rigctl.device import Fault, RigState
from rigctl.errors import TransportError
from rigctl.stream import Stream, StreamPlan
from rigctl.transport import NO_SEQUENCE, CaptureBlock, Reply


class Clock:
    time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


class Answering:
    """A rig that answers at once; its heartbeat is what the test says."""

    url, block_samples, heartbeat = "test://rig", 10, 0

    def exchange(self, block: object, run_id: int, captured: int, deadline_s: float) -> Reply:
        return Reply(
            state=RigState.HOLD,
            faults=Fault.NONE,
            last_accepted=NO_SEQUENCE,
            fifo_free=0,
            consumed=0,
            refused=False,
            heartbeat=self.heartbeat,
            owned=True,
            capture=CaptureBlock(run_id=run_id, first_index=0, values=np.empty((0, 5))),
        )


def an_axis() -> tuple[Axis, Answering, Clock, Stream]:
    clock, rig = Clock(), Answering()
    axis = Axis(rig, clock, stall_s=5.0)  # type: ignore[arg-type]  # it has the one call that is made
    plan = StreamPlan(
        run_id=axis.run_id,
        displacement_m=np.zeros(10),
        current_a=np.zeros(10),
        block_samples=10,
        fifo_samples=100,
        prefill_samples=10,
        high_water_samples=50,
    )
    return axis, rig, clock, Stream(plan=plan)


def test_a_heartbeat_that_has_stopped_in_every_answer_is_an_error() -> None:
    axis, _, clock, stream = an_axis()

    def ask_for(seconds: float) -> None:
        while clock.now() < seconds:
            axis.exchange(None, stream, 1.0)
            clock.sleep(0.005)

    ask_for(0.7)
    with pytest.raises(TransportError, match="heartbeat has stopped"):
        ask_for(0.8)


def test_a_delayed_rig_that_answers_before_its_next_heartbeat_is_not_an_error() -> None:
    axis, rig, clock, stream = an_axis()
    for _ in range(200):
        for _ in range(10):
            axis.exchange(None, stream, 1.0)
            clock.sleep(0.004)
        clock.sleep(0.7)  # neither process runs
        axis.exchange(None, stream, 1.0)  # the answer comes first
        clock.sleep(0.01)
        rig.heartbeat = (rig.heartbeat + 1) % 128
