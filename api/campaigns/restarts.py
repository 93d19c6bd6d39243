"""When the worker of a rig that ended on its own is started again: later each time, at once on an operator's word."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["Restarts"]

_AGAIN_S = (1.0, 2.0, 5.0, 15.0, 60.0)  # after the first end, the second, …: what ends at once fills no log
_STEADY_S = 60.0  # a worker that lasted so long is started again at once


@dataclass(slots=True)
class _Ends:
    """How often the worker of a rig ended shortly after its start."""

    count: int = 0
    again_at: float = 0.0  # by the steady clock
    again_at_s: float = 0.0  # seconds since 1970, for people
    paused: bool = False  # the queue, when it was seen last


@dataclass(slots=True)
class Restarts:
    """The waits of every rig, by its id. One thread writes, others may read."""

    clock: Callable[[], float] = time.monotonic
    _rigs: dict[str, _Ends] = field(default_factory=dict)

    def ended(self, rig_id: str, lasted_s: float) -> None:
        """Note that a worker ended on its own."""
        ends = self._rigs.setdefault(rig_id, _Ends())
        steady = lasted_s > _STEADY_S
        ends.count = 0 if steady else ends.count + 1
        wait_s = 0.0 if steady else _AGAIN_S[min(ends.count, len(_AGAIN_S)) - 1]
        ends.again_at, ends.again_at_s = self.clock() + wait_s, time.time() + wait_s

    def saw(self, rig_id: str, *, paused: bool) -> None:
        """Note whether the queue of a rig is paused: an operator who has resumed it waits for nothing."""
        ends = self._rigs.setdefault(rig_id, _Ends())
        if ends.paused and not paused:
            ends.count, ends.again_at = 0, 0.0
        ends.paused = paused

    def next_s(self, rig_id: str) -> float | None:
        """When the next worker is started, in seconds since 1970; None: nothing is waited for."""
        ends = self._rigs.get(rig_id)
        return None if ends is None or ends.again_at <= self.clock() else ends.again_at_s
