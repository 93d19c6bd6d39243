"""Set-points on their way in, and captured samples on their way out."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigctl.transport import NO_SEQUENCE, SEQUENCES, CaptureBlock, SetpointBlock

FIFO_SAMPLES = 4096
CAPTURE_SAMPLES = 16384


@dataclass(slots=True)
class SetpointFifo:
    """Accepts blocks strictly in order; a repeated one is acknowledged and dropped, another refused."""

    run_id: int = 0
    capacity: int = FIFO_SAMPLES
    last_accepted: int = NO_SEQUENCE
    ended: bool = False
    consumed: int = 0
    duplicates: int = 0
    gaps: int = 0
    last_m: float | None = None  # the last accepted set-point
    _rows: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def level(self) -> int:
        return int(self._rows.shape[0])

    @property
    def free(self) -> int:
        return self.capacity - self.level

    def accept(self, block: SetpointBlock) -> bool:
        """Take a block; False where it is refused and has to be sent again."""
        ahead = (block.sequence - self.last_accepted - 1) % SEQUENCES
        if block.run_id != self.run_id:
            return False
        if ahead >= SEQUENCES // 2:
            self.duplicates += 1
            return True
        if ahead or self.ended:
            self.gaps += 1
            return False
        if block.samples > self.free:
            return False
        rows = np.column_stack([block.displacement_m, block.current_a])
        self._rows = np.concatenate([self._rows, rows])
        self.last_accepted, self.ended = block.sequence, block.end_of_stream
        self.last_m = float(rows[-1, 0])
        return True

    def peek(self, count: int) -> NDArray[np.float64]:
        """Look at the next set-points, (n, 2): displacement m, current A."""
        return self._rows[:count]

    def drop(self, count: int) -> None:
        """Forget set-points that were played."""
        self._rows = self._rows[count:]
        self.consumed += count


@dataclass(slots=True)
class CaptureStore:
    """Holds captured samples until the host has acknowledged them, so that every fetch may be repeated."""

    run_id: int = 0
    capacity: int = CAPTURE_SAMPLES
    first_index: int = 0
    backlog: int = 0
    _blocks: deque[NDArray[np.float64]] = field(default_factory=deque)

    @property
    def free(self) -> int:
        return self.capacity - self.backlog

    def append(self, values: NDArray[np.float64]) -> None:
        """Add samples, (n, 5)."""
        if values.shape[0]:
            self._blocks.append(values)
            self.backlog += values.shape[0]

    def acknowledge(self, run_id: int, captured: int) -> None:
        """Forget what the host has; a number that it cannot have yet is ignored."""
        count = captured - self.first_index
        if run_id != self.run_id or not 0 < count <= self.backlog:
            return
        self.backlog, self.first_index = self.backlog - count, captured
        while count:
            head = self._blocks.popleft()
            if count < head.shape[0]:
                self._blocks.appendleft(head[count:])
            count -= min(count, head.shape[0])

    def fetch(self, most: int) -> CaptureBlock:
        """Give the oldest samples that are not acknowledged."""
        parts, room = [np.empty((0, 5))], most
        for block in self._blocks:
            parts.append(block[:room])
            room -= parts[-1].shape[0]
            if not room:
                break
        return CaptureBlock(run_id=self.run_id, first_index=self.first_index, values=np.concatenate(parts))
