"""Space on the disk for a whole run, taken before the rig is asked for power."""

from __future__ import annotations

import errno
import os
import tempfile
from contextlib import suppress
from math import ceil
from pathlib import Path
from typing import Final

from rigctl.errors import RunFileError

__all__ = ["CHUNK_SAMPLES", "CLOSING_BYTES", "DiskReserve", "allocate", "check_space", "run_bytes", "whole_blocks"]

CHUNK_SAMPLES: Final = 4096  # of each channel, written to the disk as a whole
INDEX_BYTES: Final = 64  # of HDF5's chunk index for a chunk; measured: 16 … 40
CLOSING_BYTES: Final = 1 << 21  # for what comes while the rig stops (2.5 s at 5 kHz: 0.7 MB), and to close the file
BLOCK_BYTES: Final = 1 << 16  # the largest that file systems use
_PIECE: Final = 1 << 20


def run_bytes(samples: int, channels: int) -> int:
    """Bytes that the samples of a run take on the disk, float64 in whole chunks."""
    return channels * ceil(samples / CHUNK_SAMPLES) * (8 * CHUNK_SAMPLES + INDEX_BYTES)


def whole_blocks(size: int) -> int:
    """A size rounded up to whole blocks of the disk, so that what one file gives back is enough for another."""
    return ceil(size / BLOCK_BYTES) * BLOCK_BYTES


def check_space(directory: Path, samples: int, channels: int) -> None:
    """Refuse a run that the disk cannot hold, and a folder that cannot be written: RunFileError. It makes no folder."""
    while not directory.exists() and directory != directory.parent:
        directory = directory.parent
    DiskReserve(directory, run_bytes(samples, channels) + CLOSING_BYTES).release()


class DiskReserve:
    """Disk space that nobody else can take. It has no name: it is free again when this process ends.

    The owner of the run file gives back as much as it is about to write. Another program may take that space in
    between, so that the disk can still be full; ``release`` frees the rest, for the end of the file.
    """

    def __init__(self, directory: Path, size: int) -> None:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._handle, name = tempfile.mkstemp(dir=directory, prefix=".damper-rig-reserve-")
            with suppress(PermissionError):  # Windows does not remove an open file
                Path(name).unlink()
        except OSError as error:
            raise RunFileError(f"{directory}: cannot be written ({_reason(error)})") from error
        self.size, self._name = size, Path(name)
        try:
            allocate(self._handle, 0, size)
        except OSError as error:
            self.release()
            raise RunFileError(
                f"{directory}: the run needs {size / 1e6:.1f} MB, the disk does not have them ({_reason(error)}): "
                "free space, or give another folder"
            ) from error

    def keep(self, size: int) -> None:
        """Give back everything above `size` bytes."""
        if size < self.size and self._handle >= 0:
            self.size = max(size, 0)
            os.ftruncate(self._handle, self.size)

    def release(self) -> None:
        """Give back everything; safe to call twice."""
        self.size = 0
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
            self._name.unlink(missing_ok=True)


def allocate(handle: int, start: int, size: int) -> None:
    """Make `size` bytes from `start` on real blocks of a file; where the file system has no call for it, write them.

    What the file has there already stays. Raises OSError where the disk does not have the space.
    """
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(handle, start, size)
            return
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOSYS):
                raise
    left = start + size - os.lseek(handle, 0, os.SEEK_END)
    while left > 0:
        left -= os.write(handle, bytes(min(left, _PIECE)))


def _reason(error: OSError) -> str:
    return error.strerror or " ".join(str(error).split())
