"""Handling of Ctrl-C, SIGTERM, SIGHUP and SIGQUIT: each ends a command in the same way."""

from __future__ import annotations

import signal
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from api.processes.signals import ending_signals

__all__ = ["ignore_signals", "take_hold", "take_signals"]

_AGAIN_S = 0.5  # until it is checked whether the exception was lost


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, SIGTERM, SIGHUP or SIGQUIT."""


class _Interruption:
    """Raises Interrupted in the main thread; further signals have no effect while that exception is being handled.

    A library may catch it in a callback or a bare ``except``. If it is gone and the program still runs, it is raised
    again.
    """

    def __init__(self) -> None:
        self._raised: weakref.ref[Interrupted] | None = None

    def begin(self, number: int, frame: FrameType | None) -> None:
        if self._raised is not None and self._raised() is not None:
            return
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        raise self._new_error()  # not in a local variable: the traceback would keep it alive

    def _new_error(self) -> Interrupted:
        error = Interrupted()
        self._raised = weakref.ref(error)
        return error

    def raise_again(self, number: int, frame: FrameType | None) -> None:
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        self.begin(number, frame)


def take_signals() -> None:
    """From now on a signal that ends the process raises Interrupted in the main thread."""
    interruption = _Interruption()
    for number in ending_signals():
        signal.signal(number, interruption.begin)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, interruption.raise_again)


def ignore_signals() -> None:
    """Ignore signals from now on: the exit status is settled."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_IGN)
    for number in ending_signals():
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def take_hold() -> Iterator[Callable[[], bool]]:
    """Ctrl-Z (SIGTSTP) holds and resumes; it does not suspend the process with the rig in motion."""
    held = False

    def toggle_hold(number: int, frame: FrameType | None) -> None:
        nonlocal held
        held = not held

    if not hasattr(signal, "SIGTSTP"):
        yield lambda: False
        return
    before = signal.signal(signal.SIGTSTP, toggle_hold)
    try:
        yield lambda: held
    finally:
        signal.signal(signal.SIGTSTP, before)
