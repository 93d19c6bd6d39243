"""The one way to open an HDF5 file for reading: checked as a whole before any of its data are read."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISREG
from typing import Final

import h5py

from excitation.errors import ExcitationFileError
from excitation.untrusted.contents import check_places, check_texts
from excitation.untrusted.global_heap import check_global_heaps
from excitation.untrusted.limits import Limits
from excitation.untrusted.memory_bound import bounded_memory
from excitation.untrusted.structure import check_size, walk
from excitation.untrusted.superblock import SUPERBLOCK_BYTES, check_superblock

__all__ = ["DAMAGE", "open_hdf5"]

DAMAGE: Final = (
    *(OSError, LookupError, TypeError, ValueError, RuntimeError, AttributeError, ArithmeticError, MemoryError),
    *(EOFError, struct.error),
)
"""What h5py and numpy raise on a file whose bytes were changed."""


@contextmanager
def open_hdf5(
    path: Path, refusal: type[Exception], *, limits: Limits | None = None, swmr: bool = False
) -> Iterator[h5py.File]:
    """The open file, where it holds nothing but plain numbers and texts that are in it; see docs/uploads.md.

    Raises ``refusal``, the error class of the caller's package, in one line: the file, where in it, what is wrong, and
    what would be right.
    """
    try:
        with bounded_memory():
            file = _opened(path, limits or Limits(), swmr)
    except ExcitationFileError as error:
        raise refusal(f"{path}: {error}") from None
    except DAMAGE as error:
        reason = " ".join(str(error).split())[:160]
        raise refusal(f"{path}: damaged or not an HDF5 file ({reason})") from error
    with file:
        yield file


def _opened(path: Path, limits: Limits, swmr: bool) -> h5py.File:
    with path.open("rb") as plain:
        state = os.fstat(plain.fileno())
        if not S_ISREG(state.st_mode):
            raise ExcitationFileError("not a file on a disk: copy it into one")
        check_superblock(plain.read(SUPERBLOCK_BYTES))
        file = h5py.File(path, "r", swmr=swmr)
        try:
            found = walk(file.id, limits)
            check_size(found, state.st_size)
            data = check_places(found, plain.fileno(), state.st_size)
            check_global_heaps(plain.fileno(), state.st_size, data)
            check_texts(found)
        except BaseException:
            file.close()
            raise
    return file
