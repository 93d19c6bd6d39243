"""How many workers the machine has."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_CPU_MAX = Path("/sys/fs/cgroup/cpu.max")  # of cgroup v2, as a container sees its own group


def available_workers() -> int:
    """The processors that this process may use, by its affinity and by the quota of its container; at least one."""
    return min(_processors(), _quota() or sys.maxsize)


def processors_of_quota(cpu_max: str) -> int | None:
    """Whole processors in a cgroup's `cpu.max`, "QUOTA PERIOD" in µs, at least one; None without a quota."""
    quota, _, period = cpu_max.strip().partition(" ")
    if not (quota.isdecimal() and period.isdecimal() and int(period) > 0):
        return None
    return max(int(quota) // int(period), 1)


def _quota() -> int | None:
    try:
        return processors_of_quota(_CPU_MAX.read_text(encoding="ascii"))
    except (OSError, UnicodeDecodeError):  # another system, or no cgroup v2
        return None


def _processors() -> int:
    if sys.version_info >= (3, 13):
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
