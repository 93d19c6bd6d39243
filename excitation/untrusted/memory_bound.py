"""A bound of the memory that HDF5 may take while it looks through a file.

HDF5 believes the sizes in a file: a text of 5 bytes that declares 4 GB takes 4 GB. So the whole process may take no
more than a certain amount for as long as a file is looked through, where the system has such a limit (Linux).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import Final

__all__ = ["bounded_memory"]

# The texts of a file (16 MiB at most) as bytes, as text and in HDF5; tables of 10 000 objects and 200 000 chunks:
# 0.1 GB; other threads of the process at the same time: the channels of a long run, 0.5 GB.
HEADROOM_BYTES: Final = 1 << 30
_STATE: Final = Path("/proc/self/statm")

_lock = Lock()
_inside = 0
_before: tuple[int, int] | None = None


@contextmanager
def bounded_memory(headroom: int = HEADROOM_BYTES) -> Iterator[None]:
    """Within the block an allocation beyond ``headroom`` bytes fails, in every thread. Only on Linux.

    A block within another has the bound of the outer one.
    """
    _begin(headroom)
    try:
        yield
    finally:
        _end()


def _begin(headroom: int) -> None:
    global _inside, _before
    with _lock:
        _inside += 1
        if _inside == 1 and _STATE.exists():
            _before = _limit(headroom)


def _end() -> None:
    global _inside, _before
    with _lock:
        _inside -= 1
        if _inside == 0 and _before is not None:
            import resource

            with suppress(ValueError, OSError):
                resource.setrlimit(resource.RLIMIT_AS, _before)
            _before = None


def _limit(headroom: int) -> tuple[int, int] | None:
    """The limit before this one; None where it was as low already, or cannot be set."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    most = int(_STATE.read_text().split()[0]) * resource.getpagesize() + headroom
    if before[0] != resource.RLIM_INFINITY and before[0] <= most:
        return None
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (most, before[1]))
        return before
    return None
