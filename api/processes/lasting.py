"""What is there when a process has started stays: the garbage collector does not look through it again and again."""

from __future__ import annotations

import gc

__all__ = ["collect_seldom", "keep_what_is_there", "leave_what_is_there"]

_YOUNG = 10_000  # objects: looking through so many takes 2 ms
_SEVERAL = 50  # of such collections before those that were left are looked through again: a start makes 200 000 objects
_MANY = 10  # of those before all are: as Python has it


def collect_seldom() -> None:
    """From now on a collection begins only when many objects have been made.

    The numerical libraries make some 200 000 that stay. With Python's own numbers, which suit small programs, they are
    looked through again and again while they are being imported: 0.2 s of a start.
    """
    gc.set_threshold(_YOUNG, _SEVERAL, _MANY)


def keep_what_is_there() -> None:
    """From now on a collection looks only at objects that are made later.

    To look through all modules takes about 0.2 s of a process with the numerical libraries, in which none of its
    threads runs: no stop is passed on, and no block of a stream is sent.
    """
    gc.collect()
    gc.freeze()


def leave_what_is_there() -> None:
    """This process ends: Python does not look through all objects once more, which takes up to 0.3 s."""
    gc.freeze()
