"""Calls from other threads into an event loop; many of them wake it once."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

__all__ = ["Crossing"]


class Crossing:
    """A way into one event loop. To wake a loop takes longer than most of what it is woken for."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop = loop
        self._calls: deque[Callable[[], object]] = deque()
        self._woken = False

    def call(self, do: Callable[[], object]) -> None:
        """Let the loop call ``do`` soon, in the order of the calls. From any thread."""
        self._calls.append(do)
        if not self._woken:  # two threads that see this at once wake it twice, which does no harm
            self._woken = True
            self.loop.call_soon_threadsafe(self._run)

    def _run(self) -> None:
        self._woken = False  # before the first is taken: whoever comes now wakes it again
        while self._calls:
            self._calls.popleft()()
