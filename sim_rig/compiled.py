"""How the loops of the simulated rig are compiled: once for a machine, anew when any file of this package changes."""

# numba has no types.
# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

from excitation.kernel_cache import keyed

__all__ = ["compiled", "pasted"]

_HERE = Path(__file__).parent
Loop = TypeVar("Loop", bound=Callable[..., Any])


def compiled(function: Loop) -> Loop:
    """Compile a function on its first call."""
    return cast(Loop, keyed(njit(cache=True)(function), _HERE))


def pasted(function: Loop) -> Loop:
    """Put a function into its callers before they are compiled."""
    return cast(Loop, keyed(njit(cache=True, inline="always")(function), _HERE))
