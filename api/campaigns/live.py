"""The latest samples of the running tests, kept in memory for the live page."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from threading import Lock

import numpy as np
from numpy.typing import NDArray

__all__ = ["Live", "LivePoints"]

_KEPT_BLOCKS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class LivePoints:
    """A few consecutive samples of one test; displacement m, force N."""

    number: int  # rises by one with every block that is published
    campaign_id: str
    test: str
    displacement_m: tuple[float, ...]
    force_n: tuple[float, ...]


class Live:
    """The newest blocks of all workers of this process; safe to use from many threads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._blocks: deque[LivePoints] = deque(maxlen=_KEPT_BLOCKS)
        self._number = 0

    def publish(
        self,
        campaign_id: str,
        test: str,
        displacement_m: NDArray[np.float64],  # (n,)
        force_n: NDArray[np.float64],  # (n,)
    ) -> None:
        with self._lock:
            self._number += 1
            self._blocks.append(
                LivePoints(
                    number=self._number,
                    campaign_id=campaign_id,
                    test=test,
                    displacement_m=tuple(displacement_m.tolist()),
                    force_n=tuple(force_n.tolist()),
                )
            )

    def after(self, number: int) -> tuple[LivePoints, ...]:
        """The blocks published after block ``number`` that are still kept."""
        with self._lock:
            return tuple(block for block in self._blocks if block.number > number)
