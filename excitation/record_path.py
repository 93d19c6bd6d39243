"""Where a record lies that a design plays: absolute in memory, in a plan file counted from the file's folder."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from excitation.signal import JSON

__all__ = ["resolved", "written_beside"]

_KEY = "record"


def resolved(config: Mapping[str, JSON], folder: Path) -> dict[str, JSON]:
    """The configuration of a test with its record found from ``folder``."""
    named = config.get(_KEY)
    return {**config, _KEY: str(folder.resolve() / named)} if isinstance(named, str) else dict(config)


def written_beside(config: Mapping[str, JSON], folder: Path) -> dict[str, JSON]:
    """The inverse: whoever moves plan and records together finds them. Another drive (Windows) stays absolute."""
    named = config.get(_KEY)
    if not isinstance(named, str):
        return dict(config)
    path = Path(named).resolve()
    if path.drive != folder.resolve().drive:
        return {**config, _KEY: str(path)}
    return {**config, _KEY: Path(os.path.relpath(path, folder.resolve())).as_posix()}
