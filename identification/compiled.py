"""How the loops are compiled: once for a machine, cached beside the sources, anew when any of the sources changes.

numba's cache knows a function by the file it stands in; what is compiled into it lives in other files of the same
package. So here a cached function carries in its file name a digest of that package and of this file: no version of the
code ever reads what another one wrote, whichever ran last.
"""

# numba has no types.
# mypy: allow-untyped-calls

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

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


def digest(folder: Path) -> str:
    """What the sources of a folder say, in a few letters: the same wherever and whenever they were written."""
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        found.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()[:12]


class _OfThisVersion(IndexDataCacheFile):
    """A cache file that is written only while the sources are still those that were imported."""

    def __init__(self, cache_path: Any, base: str, package: Path) -> None:
        super().__init__(cache_path, f"{base}-{_digest(package)}", _digest(package))
        self._package = package

    def save(self, key: Any, data: Any) -> None:
        if _of_package(self._package) == _digest(self._package):
            super().save(key, data)


def _keyed(dispatcher: Any) -> Any:
    cached: Any = getattr(dispatcher, "_cache", None)  # none where numba is switched off
    if hasattr(cached, "_cache_file"):
        package = _package_of(Path(dispatcher.py_func.__code__.co_filename))
        cached._cache_file = _OfThisVersion(cached.cache_path, cached._impl.filename_base, package)
    return dispatcher


def _package_of(source: Path) -> Path:
    """The folder beside this file in which a source stands, at whatever depth; the folder of this file for its own."""
    folder = source.relative_to(_HERE.parent).parts[:-1]
    return _HERE.parent.joinpath(*folder[:1])


@cache
def _digest(package: Path) -> str:
    return _of_package(package)


def _of_package(package: Path) -> str:
    return digest(package) if package == _HERE.parent else digest(package) + digest_of(_HERE)


def digest_of(path: Path) -> str:
    """What one source says, in a few letters."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:4]
