"""How often somebody may do something: a bucket of tokens each, filled at a steady rate."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

__all__ = ["Buckets", "retry_after"]

_MOST_KNOWN = 10_000  # senders that are remembered; the fullest are forgotten first, which changes nothing for them


class Buckets:
    """Each sender may spend ``burst`` tokens at once and ``per_s`` tokens a second in the long run."""

    def __init__(self, *, per_s: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.per_s, self.burst = per_s, burst
        self._clock = clock
        self._left: dict[str, tuple[float, float]] = {}  # sender -> tokens, and when that was

    def wait_s(self, sender: str) -> float:
        """Take a token and return 0; where none is left, take none and return the time until there is one."""
        left = self._now(sender)
        if left >= 1.0:
            self._left[sender] = (left - 1.0, self._clock())
            if len(self._left) > _MOST_KNOWN:
                self._forget()
            return 0.0
        return (1.0 - left) / self.per_s

    def empty(self, sender: str) -> float:
        """As ``wait_s``, but takes nothing."""
        left = self._now(sender)
        return 0.0 if left >= 1.0 else (1.0 - left) / self.per_s

    def _now(self, sender: str) -> float:
        tokens, at = self._left.get(sender, (self.burst, 0.0))
        return min(self.burst, tokens + (self._clock() - at) * self.per_s)

    def _forget(self) -> None:
        fullest = sorted(self._left, key=self._now, reverse=True)[: _MOST_KNOWN // 2]
        for sender in fullest:
            del self._left[sender]


def retry_after(wait_s: float) -> dict[str, str]:
    """The header that says when to try again: whole seconds, at least 1."""
    return {"Retry-After": str(max(1, math.ceil(wait_s)))}
