"""How many workers the machine has."""

from __future__ import annotations

import os
import sys


def available_workers() -> int:
    """The processors that this process may use, at least one."""
    if sys.version_info >= (3, 13):
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
