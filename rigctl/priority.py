"""Real-time priority for the calling thread, so that other programs do not delay a stream."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from rigctl.memory_lock import locked_memory

PRIORITY = 10  # of 1 … 99: above ordinary processes, below the system's own real-time threads


@contextmanager
def real_time_priority() -> Iterator[bool]:
    """Run the calling thread with real-time priority; yields whether the system permits it.

    Linux permits it to root, with CAP_SYS_NICE, or up to RLIMIT_RTPRIO (``ulimit -r``). Without it nothing changes.
    """
    if sys.platform != "linux":
        yield False
        return
    policy, param = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    except OSError:
        yield False
        return
    try:
        yield True
    finally:
        os.sched_setscheduler(0, policy, param)


@contextmanager
def streaming_priority() -> Iterator[str]:
    """Real-time priority and locked memory for a stream; yields one line that says what the system permitted."""
    with real_time_priority() as first, locked_memory() as locked:
        priority = f"real-time priority {PRIORITY}" if first else "no real-time priority (see ulimit -r)"
        yield f"{priority}, {'memory locked' if locked else 'memory not locked (see ulimit -l)'}"


def drop_priority() -> None:
    """Return to ordinary priority, in a thread that inherited real-time priority."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
