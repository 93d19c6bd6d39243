"""The cache of compiled loops: compiled once for a machine, kept beside the sources, anew when any of them changes.

numba's cache knows a function by the file it stands in; what is compiled into it lives in other files. So here a
cached function carries in its file name a digest of the sources that it is made of: no version of the code ever reads
what another one wrote, whichever ran last.
"""

# numba has no types.
# mypy: allow-untyped-calls

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import IndexDataCacheFile

__all__ = ["digest", "keyed"]


def keyed(dispatcher: Any, *sources: Path) -> Any:
    """A function of ``numba.njit(cache=True)`` whose cache is read only where these files and folders say the same."""
    cached: Any = getattr(dispatcher, "_cache", None)  # none where numba is switched off
    if hasattr(cached, "_cache_file"):
        cached._cache_file = _OfThisVersion(cached.cache_path, cached._impl.filename_base, sources)
    return dispatcher


def digest(source: Path) -> str:
    """What a source, or all sources of a folder say, in a few letters: wherever and whenever they were written."""
    if source.is_file():
        return hashlib.sha256(source.read_bytes()).hexdigest()[:4]
    found = hashlib.sha256()
    for path in sorted(source.rglob("*.py")):
        found.update(str(path.relative_to(source)).encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()[:12]


class _OfThisVersion(IndexDataCacheFile):
    """A cache file that is written only while the sources are still those that were imported."""

    def __init__(self, cache_path: Any, base: str, sources: tuple[Path, ...]) -> None:
        super().__init__(cache_path, f"{base}-{_imported(sources)}", _imported(sources))
        self._sources = sources

    def save(self, key: Any, data: Any) -> None:
        if _said(self._sources) == _imported(self._sources):
            super().save(key, data)


@cache
def _imported(sources: tuple[Path, ...]) -> str:
    return _said(sources)


def _said(sources: tuple[Path, ...]) -> str:
    return "".join(map(digest, sources))
