"""The disk must keep some space free: for the test that runs, for the database, and to stop in good order."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from api.errors import TOO_FEW_FILES, TOO_MANY_OPEN, Busy, DiskFull
from api.settings import LEAST_FREE_BYTES

__all__ = ["DiskSpace", "storage_errors"]

_FULL: Final = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskSpace:
    """Of the disk that holds ``folder``."""

    folder: Path
    least_free_bytes: int = LEAST_FREE_BYTES

    def check(self, needed_bytes: int = 0) -> None:
        """Raise DiskFull, one line, where less than ``least_free_bytes`` would be free after ``needed_bytes``."""
        place = self.folder
        while not place.exists() and place != place.parent:
            place = place.parent
        free = shutil.disk_usage(place).free
        if free - needed_bytes < self.least_free_bytes:
            raise DiskFull(
                f"the disk of the run files has {free / 1e9:.3g} GB free: {self.least_free_bytes / 1e9:.3g} GB must "
                "stay free: remove old runs or results, or set least_free_bytes"
            )


@contextmanager
def storage_errors() -> Iterator[None]:
    """Translate a disk that fills, and descriptors that run out, into DiskFull and Busy; names no folder."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise DiskFull("the disk of the run files is full: remove old runs or results") from error
        if error.errno in TOO_FEW_FILES:
            raise Busy(TOO_MANY_OPEN, retry_after_s=5) from error
        raise
