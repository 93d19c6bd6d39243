"""What a process beside rig control may take, and that it is the first to end where memory runs out (Linux)."""

from __future__ import annotations

import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Final

__all__ = ["DATA_DIES_FIRST", "JOB_DIES_FIRST", "computer_memory", "die_first", "limit", "was_at_work"]

# Of the time that a process had. Without other load one that only reads and computes takes nearly all of it, one of the
# lowest priority on a computer that is full a tenth. Half of it: a slow disk is blamed on the file; double: so is load.
AT_WORK_SHARE: Final = 0.5

# Of 1000. The reader of a file from elsewhere before a job, a job before the service and the workers of the rigs (0).
DATA_DIES_FIRST: Final = 1000
JOB_DIES_FIRST: Final = 900
_OWN: Final = Path("/proc/self")
_CONTAINER: Final = Path("/sys/fs/cgroup/memory.max")  # of cgroup v2


def die_first(score: int) -> None:
    """Where memory runs out, the system ends this process, and what it starts, before one that moves a rig."""
    if _OWN.is_dir():
        with suppress(OSError):  # a container may forbid it
            (_OWN / "oom_score_adj").write_text(str(score))


def limit(name: str, value: int) -> None:
    """Lower a limit of this process, for example RLIMIT_CPU; no error where the system has no such limit."""
    try:
        import resource
    except ImportError:  # Windows
        return
    number = getattr(resource, name)
    hard = resource.getrlimit(number)[1]
    most = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(number, (most, most))


def was_at_work(process: subprocess.Popen[bytes], given_s: float) -> bool:
    """Kill a process after ``given_s``; whether it was at work in that time, rather than waiting for its turn.

    True also where the system does not tell (Windows).
    """
    process.kill()
    if not hasattr(os, "wait4") or process.returncode is not None:
        return True
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime >= AT_WORK_SHARE * given_s


def computer_memory() -> int | None:
    """Bytes of memory of this computer, or of its container if that has less; None if the system does not tell."""
    try:
        found = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
    with suppress(OSError, ValueError):  # no container, or "max"
        found = min(found, int(_CONTAINER.read_text()))
    return found
