"""Ends this process with its parent, even where the parent was killed."""

from __future__ import annotations

import os
import signal
import sys
from threading import Thread

__all__ = ["end_with_parent"]


def end_with_parent() -> None:
    """Send SIGTERM to this process as soon as its standard input closes."""
    Thread(target=_wait_for_the_end, name="parent", daemon=True).start()


def _wait_for_the_end() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
