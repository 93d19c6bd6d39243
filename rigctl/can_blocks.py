"""Converts between the host's block numbers and the numbers of frames or commits on the bus; pure counting."""

from __future__ import annotations

from rigctl.transport import NO_SEQUENCE, SEQUENCES, SetpointBlock


class BlockCount:
    """One block of the host is up to `units` numbered units of `unit_samples` set-points.

    On classic CAN a unit is a committed block, on FD a frame: the rig numbers, accepts and refuses units. When a
    partly accepted block is sent again, the rig drops the units that it has.
    """

    def __init__(self, *, units: int, unit_samples: int) -> None:
        self._units, self._unit_samples = units, unit_samples
        self._accepted = self._furthest = 0  # units, set-points
        self._ends: dict[int, int] = {}  # block → units up to its end
        self.last_block = NO_SEQUENCE

    def first_unit(self, block: SetpointBlock) -> int:
        """Return the number of the block's first unit, and remember where the block ends."""
        start = block.sequence * self._units
        self._ends[block.sequence] = start - (-block.samples // self._unit_samples)
        self._furthest = max(self._furthest, start * self._unit_samples + block.samples)
        return start

    def note(self, last_unit: int) -> None:
        """Note which unit the rig accepted last."""
        newly = (last_unit + 1 - self._accepted) % SEQUENCES
        if 0 < newly < SEQUENCES // 2:
            self._accepted += newly
            self.last_block = (self._accepted // self._units - 1) % SEQUENCES
        for block, end in list(self._ends.items()):
            if end <= self._accepted:
                del self._ends[block]
                if end == self._accepted:  # the last block of a stream may be shorter
                    self.last_block = block % SEQUENCES

    def has(self, block: SetpointBlock) -> bool:
        """Whether the rig has the whole block."""
        return block.sequence not in self._ends

    @property
    def samples(self) -> int:
        """Set-points that the rig has accepted."""
        return min(self._accepted * self._unit_samples, self._furthest)
