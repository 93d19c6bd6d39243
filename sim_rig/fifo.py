"""The FIFO of set-points, and the store of captured samples."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigctl.setpoint_check import Before
from rigctl.transport import SEQUENCES, CaptureBlock, SetpointBlock

FIFO_SAMPLES = 16384  # 3.3 s at 5 kHz, longer than an ordinary computer is late
CAPTURE_SAMPLES = 32768


@dataclass(slots=True)
class SetpointFifo:
    """Accepts blocks strictly in order; a repeated one is acknowledged and dropped, another refused."""

    run_id: int = 0
    capacity: int = FIFO_SAMPLES
    following: int = 0  # number of the next block
    ended: bool = False
    closed: bool = False  # the run is over: nothing is accepted any more
    consumed: int = 0
    duplicates: int = 0
    gaps: int = 0
    before: Before | None = None  # the set-points before the next block; None: nothing is accepted yet
    _first: int = 0  # index of the first set-point that is not played yet
    _last: int = 0
    _rows: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self._rows = np.empty((2 * self.capacity, 2))

    @property
    def last_accepted(self) -> int:
        """Number of the last block, modulo 65 536."""
        return (self.following - 1) % SEQUENCES

    @property
    def level(self) -> int:
        return self._last - self._first

    @property
    def free(self) -> int:
        return self.capacity - self.level

    def accept(self, block: SetpointBlock) -> bool:
        """Accept a block; False where it is refused and has to be sent again."""
        ahead = block.sequence - self.following
        if block.run_id != self.run_id:
            return False
        if self.closed:
            return False
        if ahead < 0:
            self.duplicates += 1
            return True
        if ahead or self.ended:
            self.gaps += 1
            return False
        if block.samples > self.free:
            return False
        self._append(np.column_stack([block.displacement_m, block.current_a]))
        self.following, self.ended = block.sequence + 1, block.end_of_stream
        return True

    def close(self) -> None:
        """Discard what was not played, and accept nothing more."""
        self._first, self.closed = self._last, True

    def _append(self, rows: NDArray[np.float64]) -> None:
        if self._last + rows.shape[0] > self._rows.shape[0]:  # end of the array: move the rows to its beginning
            level = self.level
            self._rows[:level] = self._rows[self._first : self._last]
            self._first, self._last = 0, level
        self._rows[self._last : self._last + rows.shape[0]] = rows
        self._last += rows.shape[0]

    def peek(self, count: int) -> NDArray[np.float64]:
        """The next set-points, (n, 2): displacement m, current A."""
        return self._rows[self._first : min(self._first + count, self._last)].copy()

    def newest(self, count: int) -> NDArray[np.float64]:
        """The last accepted set-points, (count, 2)."""
        return self._rows[self._last - count : self._last].copy()

    def drop(self, count: int) -> None:
        """Remove set-points that were played, also where the run was closed while they were."""
        self._first = min(self._first + count, self._last)
        self.consumed += count


@dataclass(slots=True)
class CaptureStore:
    """Holds captured samples until the host has acknowledged them, so that every fetch may be repeated."""

    session: int = 0
    run_id: int = 0
    capacity: int = CAPTURE_SAMPLES
    first_index: int = 0
    backlog: int = 0
    channels: int = 5
    _blocks: deque[NDArray[np.float64]] = field(default_factory=deque)

    @property
    def free(self) -> int:
        return self.capacity - self.backlog

    def append(self, values: NDArray[np.float64]) -> None:
        """Add samples, (n, channels)."""
        if values.shape[0]:
            self._blocks.append(values)
            self.backlog += values.shape[0]

    def acknowledge(self, run_id: int, captured: int) -> None:
        """Remove samples that the host has acknowledged; a number beyond the captured ones is ignored."""
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
        """Return the oldest samples that are not acknowledged."""
        parts, remaining = [np.empty((0, self.channels))], most
        for block in self._blocks:
            parts.append(block[:remaining])
            remaining -= parts[-1].shape[0]
            if not remaining:
                break
        return CaptureBlock(run_id=self.run_id, first_index=self.first_index, values=np.concatenate(parts))

    def beyond(self, ahead: int, most: int) -> NDArray[np.float64]:
        """Of the ``most`` oldest samples that are not acknowledged, those after the first ``ahead``, (n, channels).

        Looks from the end: where all but the last few were sent, it costs as much as those.
        """
        wanted, left = min(most, self.backlog) - ahead, self.backlog - ahead
        parts = [np.empty((0, self.channels))]
        if wanted > 0:
            for block in reversed(self._blocks):
                parts.append(block[max(block.shape[0] - left, 0) :])
                left -= parts[-1].shape[0]
                if not left:
                    break
        return np.concatenate(parts[::-1])[: max(wanted, 0)]
