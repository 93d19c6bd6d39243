"""Closing an HDF5 file whose disk has failed.

HDF5 keeps what it could not write, tries again when the file is closed or the process ends, and a process in which that
fails again is taken down by the system. So such a file is given a copy of itself in memory to write to.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO, Final

import h5py

__all__ = ["DISK_ERRORS", "close_anyway"]

DISK_ERRORS: Final = (OSError, RuntimeError)  # HDF5 reports an error of a write as either


def close_anyway(file: h5py.File, path: Path) -> None:
    """Close an open HDF5 file without another write to the disk: `path` stays as it is."""
    with _memory() as memory:
        with path.open("rb") as disk:
            shutil.copyfileobj(disk, memory)
        os.dup2(memory.fileno(), file.id.get_vfd_handle())
        with suppress(*DISK_ERRORS):
            file.flush()
        with suppress(*DISK_ERRORS):
            file.close()


def _memory() -> IO[bytes]:
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("damper-rig"), "w+b", buffering=0)
    return tempfile.TemporaryFile(buffering=0)
