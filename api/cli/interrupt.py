"""Ctrl-C and SIGTERM: one tidy way out, which impatience cannot break and no library can swallow."""

from __future__ import annotations

import signal
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["ignore_signals", "take_hold", "take_signals"]

_AGAIN_S = 0.5
_ENDING = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C or SIGTERM."""


class _Way:
    """Raises in the main thread, once: as long as that exception is on its way out, more signals change nothing.

    It may be raised inside somebody's callback or bare ``except`` and vanish there. It is looked after: where it
    is gone though the program goes on, it is raised again.
    """

    def __init__(self) -> None:
        self._on_its_way: weakref.ref[Interrupted] | None = None

    def begin(self, number: int, frame: FrameType | None) -> None:
        if self._on_its_way is not None and self._on_its_way() is not None:
            return
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        raise self._made()  # in no variable here: the traceback would keep it alive for ever

    def _made(self) -> Interrupted:
        error = Interrupted()
        self._on_its_way = weakref.ref(error)
        return error

    def look_after(self, number: int, frame: FrameType | None) -> None:
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        self.begin(number, frame)


def take_signals() -> None:
    """From now on SIGINT and SIGTERM raise Interrupted in the main thread."""
    way = _Way()
    for number in _ENDING:
        signal.signal(number, way.begin)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, way.look_after)


def ignore_signals() -> None:
    """The exit status is settled: nothing changes it while Python ends."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_IGN)
    for number in _ENDING:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def take_hold() -> Iterator[Callable[[], bool]]:
    """Ctrl-Z (SIGTSTP) asks for a hold, and again to go on, instead of stopping the process with the rig in motion."""
    held = False

    def turn(number: int, frame: FrameType | None) -> None:
        nonlocal held
        held = not held

    if not hasattr(signal, "SIGTSTP"):
        yield lambda: False
        return
    before = signal.signal(signal.SIGTSTP, turn)
    try:
        yield lambda: held
    finally:
        signal.signal(signal.SIGTSTP, before)
