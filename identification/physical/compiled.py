"""How the loops are compiled: once for a machine, cached beside the sources, anew when any of the sources changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

# Nothing in the loops allocates, so arrays need no reference counting; counted at every call of every element they cost
# more than the equations (measured: 90 ns a sample against 8).
_OPTIONS: Any = {"cache": True, "error_model": "numpy", "nogil": True, "_nrt": False}  # Any: _nrt has no public type
_SOURCES = ("damping", "friction", "springs", "modifiers", "memory", "core", "mount", "stage", "rigid", "mounted")


def compiled(function: Callable[..., Any]) -> Any:  # Any: numba's dispatcher has no type
    """Compile a function on its first call."""
    return _stamped(njit(**_OPTIONS)(function))


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into each of its callers."""
    return _stamped(njit(forceinline=True, **_OPTIONS)(function))


def pasted(function: Callable[..., Any]) -> Any:
    """Put a function into its only caller before that is compiled: it costs no compilation of its own."""
    return _stamped(njit(inline="always", **_OPTIONS)(function))


def _stamped(dispatcher: Any) -> Any:
    """numba looks only at the file of the function itself; what it calls lives in other files of the same set."""
    cache: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache, "_source_stamp"):
        cache._source_stamp = _STAMP
    return dispatcher


def _stamp() -> tuple[float, int]:
    """Newest time and total size of the sources, in the form of numba's own stamp."""
    files = [Path(__file__).with_name(f"{name}.py") for name in _SOURCES]
    stats = [file.stat() for file in files if file.exists()]  # an archive without files keeps numba's own rule
    return max((s.st_mtime for s in stats), default=0.0), sum(s.st_size for s in stats)


_STAMP = _stamp()
