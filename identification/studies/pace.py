"""How far a study is, and how long it will still take."""

from __future__ import annotations

import time
from collections.abc import Callable

Tell = Callable[[float, str], None]  # told the share that is done, 0 … 1, and what is being done


def silent(done: float, text: str) -> None:
    """Tells nobody."""


def part(tell: Tell, begin: float, end: float) -> Tell:
    """Tells of a part of the work as of the whole, of which it is from `begin` to `end`, 0 … 1."""

    def told(done: float, text: str) -> None:
        tell(begin + (end - begin) * done, text)

    return told


def with_time_left(
    tell: Tell, what: str, *, already: int = 0, clock: Callable[[], float] = time.monotonic
) -> Callable[[int, int], None]:
    """Tells of tasks done and the time left at their rate so far: a function of (done, count)."""
    began = clock()

    def told(done: int, count: int) -> None:
        fresh = done - already
        left = (clock() - began) * (count - done) / fresh if fresh > 0 else 0.0
        tell(done / count, f"{what}, {_time(left)} left" if done < count else what)

    return told


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
