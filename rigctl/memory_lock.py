"""Memory that is never paged out, so that a stream does not wait for a disk."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

# <sys/mman.h> of Linux: all pages, now and later, as soon as they are first used
CURRENT, FUTURE, ON_FAULT = 1, 2, 4

_guard = Lock()
_holders = 0


@contextmanager
def locked_memory() -> Iterator[bool]:
    """Lock the memory of this process; yields whether the system permits it.

    It is asked for only where no limit can make a later allocation fail: by root, or with ``ulimit -l unlimited``.
    """
    locked = _lock()
    try:
        yield locked
    finally:
        if locked:
            _unlock()


def _lock() -> bool:
    global _holders
    with _guard:
        if _holders == 0 and not (_unlimited() and _call("mlockall", CURRENT | FUTURE | ON_FAULT)):
            return False
        _holders += 1
        return True


def _unlock() -> None:
    global _holders
    with _guard:
        _holders -= 1
        if _holders == 0:
            _call("munlockall")


def _unlimited() -> bool:
    if sys.platform != "linux":
        return False
    import resource

    return os.geteuid() == 0 or resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY


def _call(name: str, *flags: int) -> bool:
    try:
        return bool(getattr(ctypes.CDLL(None), name)(*flags) == 0)
    except (OSError, AttributeError):  # a C library without it
        return False
