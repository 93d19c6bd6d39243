"""How the loops are compiled: once for a machine, cached beside the sources, anew when any of the sources changes.

Each is kept under a digest of its package, the folder beside this file in which it stands, and of this file.
"""

# numba has no types.
# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

from excitation.kernel_cache import keyed

# Nothing in the loops allocates, so arrays need no reference counting; counted at every call of every element they cost
# more than the equations (measured: 90 ns a sample against 8).
# A product may be added without being rounded first, as C compilers do by default; nothing else is loosened.
_OPTIONS: Any = {  # Any: _nrt has no public type
    "cache": True,
    "error_model": "numpy",
    "nogil": True,
    "_nrt": False,
    "fastmath": {"contract", "nsz"},
}
_HERE = Path(__file__)


def compiled(function: Callable[..., Any]) -> Any:  # Any: numba's dispatcher has no type
    """Compile a function on its first call."""
    return _keyed(njit(**_OPTIONS)(function))


def summing(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums may be taken in any order, so that several numbers are added at once."""
    return _keyed(njit(**_OPTIONS | {"fastmath": {"contract", "nsz", "reassoc"}})(function))


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into each of its callers."""
    return _keyed(njit(forceinline=True, **_OPTIONS)(function))


def pasted(function: Callable[..., Any]) -> Any:
    """Put a function into its only caller before that is compiled: it costs no compilation of its own."""
    return _keyed(njit(inline="always", **_OPTIONS)(function))


def _keyed(dispatcher: Any) -> Any:
    package = _package_of(Path(dispatcher.py_func.__code__.co_filename))
    return keyed(dispatcher, package) if package == _HERE.parent else keyed(dispatcher, package, _HERE)


def _package_of(source: Path) -> Path:
    """The folder beside this file in which a source stands, at whatever depth; the folder of this file for its own."""
    folder = source.relative_to(_HERE.parent).parts[:-1]
    return _HERE.parent.joinpath(*folder[:1])
