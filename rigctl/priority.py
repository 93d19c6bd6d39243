"""The calling thread ahead of ordinary work, where the system permits it: a stream must not wait behind a compiler."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

LEVEL = 10  # of 1 … 99: ahead of everything ordinary, behind what keeps the computer itself alive


@contextmanager
def ahead() -> Iterator[bool]:
    """Run the calling thread with real-time priority; say whether the system permits it.

    Linux permits it to root, with CAP_SYS_NICE, or up to RLIMIT_RTPRIO (``ulimit -r``). Without it nothing changes.
    """
    if sys.platform != "linux":
        yield False
        return
    policy, param = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(LEVEL))
    except OSError:
        yield False
        return
    try:
        yield True
    finally:
        os.sched_setscheduler(0, policy, param)


def behind() -> None:
    """Be ordinary again, in a thread that was begun by one that is ahead."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
