"""Captured rows as they arrive in frames of one kind: in order, each once; a gap is noticed. Pure counting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Arrived:
    """The rows that the rig does not hold back any more, from the last acknowledged one on."""

    def __init__(self, columns: int) -> None:
        self._rows: NDArray[np.float64] = np.empty((0, columns))
        self._new: list[NDArray[np.float64]] = []
        self.next = 0  # index of the row that follows

    def add(self, first: int, values: NDArray[np.float64]) -> bool:
        """Append what follows the last row; False where rows between are missing: the rig has to send again."""
        known = self.next - first
        if 0 <= known < values.shape[0]:
            self._new.append(values[known:])
            self.next += values.shape[0] - known
        return known >= 0

    def drop(self, captured: int) -> None:
        """Drop the rows below `captured`."""
        rows = self.rows
        self._rows = rows[max(captured - (self.next - rows.shape[0]), 0) :]

    @property
    def rows(self) -> NDArray[np.float64]:
        """All rows, (n, columns); the last one has the index `next` - 1."""
        self._rows, self._new = np.concatenate([self._rows, *self._new]), []
        return self._rows
