"""One direction of a wire with faults: frames are lost, delayed, doubled, reordered or damaged."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count
from typing import Final, Generic, TypeVar

import numpy as np

from sim_rig.faults import FRAMES, FaultKind, FaultOrder, Faults

T = TypeVar("T")
LATE_S: Final = 0.03  # of a delayed frame and of all frames after it
OVERTAKEN_S: Final = 0.01  # of a reordered frame: later frames overtake it


class FaultyWire(Generic[T]):
    """Carries frames with the faults of a rig.

    `damage` returns a damaged frame, or None where the checksum of the bus (CAN's CRC, TCP's sum) would discard
    it: what arrives damaged can be found only by the checksums of the protocol.
    """

    def __init__(
        self,
        faults: Faults,
        now: Callable[[], float],
        damage: Callable[[T, np.random.Generator], T | None],
        *,
        seed: int = 1,
    ) -> None:
        self._faults, self._now, self._damage = faults, now, damage
        self._random = np.random.default_rng([seed, 0xFA])
        self._under_way: list[tuple[float, int, T]] = []
        self._number = count()
        self._not_before = float("-inf")

    def put(self, frame: T) -> None:
        """Send a frame."""
        for order in self._faults.select(*FRAMES):
            if self._faults.due(order) and self._random.random() < order.share:
                self._spoil(order, frame)
                return
        self._carry(frame)

    def take(self) -> list[T]:
        """Return the frames that have arrived, in order of arrival."""
        arrived = []
        while self._under_way and self._under_way[0][0] <= self._now() and not self._silent:
            arrived.append(heapq.heappop(self._under_way)[2])
        return arrived

    @property
    def due_s(self) -> float | None:
        """Seconds until the next frame arrives; None where none is in transit."""
        if not self._under_way:
            return None
        return max(self._under_way[0][0] - self._now(), self._stalled_s, 0.0)

    @property
    def _stalled_s(self) -> float:
        return max((self._faults.remaining_s(order) for order in self._faults.select(FaultKind.STALLED)), default=0.0)

    @property
    def _silent(self) -> bool:
        return self._stalled_s > 0

    def _spoil(self, order: FaultOrder, frame: T) -> None:
        self._faults.frames_hit += 1
        match order.kind:
            case FaultKind.DELAYED:
                self._not_before = max(self._not_before, self._now() + LATE_S)
                self._carry(frame)
            case FaultKind.DOUBLED:
                self._carry(frame)
                self._carry(frame)
            case FaultKind.REORDERED:
                self._carry(frame, OVERTAKEN_S)
            case FaultKind.CORRUPTED:
                damaged = self._damage(frame, self._random)
                if damaged is not None:
                    self._carry(damaged)

    def _carry(self, frame: T, late_s: float = 0.0) -> None:
        if not self._faults.is_off:
            due = max(self._now() + late_s, self._not_before)
            heapq.heappush(self._under_way, (due, next(self._number), frame))


def flip(data: bytes, first: int, random: np.random.Generator) -> bytes:
    """Flip one bit at or behind a byte."""
    at = int(random.integers(first, len(data)))
    return data[:at] + bytes([data[at] ^ 1 << int(random.integers(8))]) + data[at + 1 :]
