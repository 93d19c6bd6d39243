"""Fills the rig's FIFO and empties its capture store: a pure state machine without sockets and clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import TransportError
from rigctl.transport import SEQUENCES, CaptureBlock, Reply, SetpointBlock


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamPlan:
    """The set-points of one run and the sizes of block, FIFO and water marks."""

    run_id: int
    displacement_m: NDArray[np.float64]  # (N,)
    current_a: NDArray[np.float64]  # (N,)
    block_samples: int
    fifo_samples: int
    prefill_samples: int
    high_water_samples: int

    @property
    def samples(self) -> int:
        return int(self.displacement_m.size)

    @property
    def blocks(self) -> int:
        return -(-self.samples // self.block_samples)

    def block(self, number: int) -> SetpointBlock:
        """Return one block; the last one has the end-of-stream flag."""
        part = slice(number * self.block_samples, (number + 1) * self.block_samples)
        return SetpointBlock(
            run_id=self.run_id,
            sequence=number,
            displacement_m=self.displacement_m[part],
            current_a=self.current_a[part],
            end_of_stream=number == self.blocks - 1,
        )

    def samples_before(self, number: int) -> int:
        """Count the samples in the blocks before this one."""
        return min(number * self.block_samples, self.samples)


@dataclass(slots=True)
class Stream:
    """State of one run: blocks sent and accepted, samples consumed and captured.

    Credits: sent − consumed never exceeds the FIFO's high-water mark. Go-back-N: after a refusal all blocks
    from the refused one are sent again. A captured sample counts once, however often it comes.
    """

    plan: StreamPlan
    sent_blocks: int = 0
    accepted_blocks: int = 0
    consumed: int = 0
    captured: int = 0
    resent_blocks: int = 0
    furthest_blocks: int = 0  # most that was ever sent, before any rewind
    repeated_captures: int = 0

    def next_block(self) -> SetpointBlock | None:
        """Return the block to send now; None without credit or when all are sent."""
        if self.sent_blocks == self.plan.blocks:
            return None
        after = self.plan.samples_before(self.sent_blocks + 1)
        if after - self.consumed > min(self.plan.high_water_samples, self.plan.fifo_samples):
            return None
        self.sent_blocks += 1
        self.furthest_blocks = max(self.furthest_blocks, self.sent_blocks)
        return self.plan.block(self.sent_blocks - 1)

    @property
    def prefilled(self) -> bool:
        """Whether enough set-points are accepted for the rig to start."""
        plan = self.plan
        mark = max(plan.high_water_samples - plan.block_samples, 1)  # whole blocks may not reach the mark exactly
        return plan.samples_before(self.accepted_blocks) >= min(plan.prefill_samples, mark, plan.samples)

    @property
    def finished(self) -> bool:
        """Whether every captured sample has arrived."""
        return self.captured == self.plan.samples

    def rewind(self) -> None:
        """Send again from the first block that the rig is not known to have: a refusal, a lost answer."""
        self.resent_blocks += self.sent_blocks - self.accepted_blocks
        self.sent_blocks = self.accepted_blocks

    def take(self, reply: Reply) -> CaptureBlock | None:
        """Update from a reply; return its new captured samples, or None.

        Raises
        ------
        TransportError
            When the rig acknowledges what was never sent, or skips captured samples: one was lost for good.
        """
        self._acknowledge(reply.last_accepted)
        self._consume(reply.consumed)
        if reply.refused:
            self.rewind()
        return self._capture(reply.capture)

    def _acknowledge(self, last_accepted: int) -> None:
        newly = (last_accepted + 1 - self.accepted_blocks) % SEQUENCES
        if newly > SEQUENCES // 2:
            return  # an old answer that came late
        if self.accepted_blocks + newly > self.furthest_blocks:
            raise TransportError(f"the rig acknowledges block {last_accepted}, which was never sent")
        self.accepted_blocks += newly
        self.sent_blocks = max(self.sent_blocks, self.accepted_blocks)  # sent before a rewind, and arrived

    def _consume(self, consumed: int) -> None:
        if consumed > self.plan.samples_before(self.furthest_blocks):  # on CAN a block may have arrived in part
            raise TransportError(f"the rig claims to have played {consumed} samples, more than it was given")
        self.consumed = max(self.consumed, consumed)

    def _capture(self, block: CaptureBlock) -> CaptureBlock | None:
        if block.samples == 0 or block.run_id != self.plan.run_id:
            return None
        if block.first_index > self.captured:
            raise TransportError(
                f"captured samples {self.captured} … {block.first_index - 1} are lost: the rig skipped them"
            )
        known = min(self.captured - block.first_index, block.samples)
        self.repeated_captures += known
        if known == block.samples:
            return None
        fresh = CaptureBlock(run_id=block.run_id, first_index=self.captured, values=block.values[known:])
        self.captured += fresh.samples
        return fresh
