"""The latest samples of the running tests, kept in memory for the live page."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from threading import Lock
from typing import Any

__all__ = ["Live", "LivePoints"]

_KEPT_BLOCKS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class LivePoints:
    """Consecutive points of one test, as :class:`api.campaigns.live_loop.LoopPoints` has them."""

    number: int  # rises by one with every block that is published
    said: dict[str, Any]  # Any: JSON, as the worker said it


class Live:
    """The newest blocks of all workers, as they say them on their lines; safe to use from many threads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._blocks: deque[LivePoints] = deque(maxlen=_KEPT_BLOCKS)
        self._number = 0

    def publish(self, said: dict[str, Any]) -> None:
        """Keep what a worker said of its test. Any: JSON."""
        with self._lock:
            self._number += 1
            self._blocks.append(LivePoints(number=self._number, said=said))

    def after(self, number: int) -> tuple[LivePoints, ...]:
        """The blocks published after block ``number`` that are still kept."""
        with self._lock:
            return tuple(block for block in self._blocks if block.number > number)
