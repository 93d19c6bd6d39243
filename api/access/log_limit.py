"""What keeps the log small and free of keys: one line of a kind per interval, with a count of the others."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from api.access.tokens import redacted

__all__ = ["LogLimit", "Redaction"]

_MOST_KINDS = 1000


class LogLimit(logging.Filter):
    """Lets the first records of a kind pass in every interval, and says how many did not.

    A kind is a logger, a level and a message without its values. The audit log always passes.
    """

    def __init__(self, interval_s: float = 10.0, most: int = 5, clock: Callable[[], float] = time.monotonic) -> None:
        """``most``: records of a kind in an interval that pass before they are counted."""
        super().__init__()
        self._interval_s, self._most, self._clock = interval_s, most, clock
        self._kinds: dict[tuple[str, int, str], tuple[float, int]] = {}  # begin of the interval, records in it

    def filter(self, record: logging.LogRecord) -> bool:
        if record.name == "damper_rig.audit":
            return True
        kind, now_s = (record.name, record.levelno, str(record.msg)[:200]), self._clock()
        begun_s, count = self._kinds.get(kind, (now_s, 0))
        if now_s - begun_s >= self._interval_s:
            if count > self._most:
                record.msg = f"{record.getMessage()} (and {count - self._most} more like it before)"
                record.args = None
            begun_s, count = now_s, 0
        if len(self._kinds) >= _MOST_KINDS and kind not in self._kinds:
            self._kinds.clear()
        self._kinds[kind] = (begun_s, count + 1)
        return count < self._most


class Redaction(logging.Formatter):
    """Formats as another formatter does, tracebacks included, without keys."""

    def __init__(self, inner: logging.Formatter) -> None:
        super().__init__()
        self._inner = inner

    def format(self, record: logging.LogRecord) -> str:
        return redacted(self._inner.format(record))
