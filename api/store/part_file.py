"""What is being written: marked by a file ``….part`` that its writer locks, so that the next start can remove it.

An upload is ``uploads/ID/NAME.part``. The row in the store is what makes it a run; only then it gets its name. A crash
in between is put right at the start: with a row it is named, without it is removed. The result of a job is a folder
``ID`` with an empty ``ID.part`` beside it: at the start it is kept where the row says that the job is done.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from typing import Final

from excitation.atomic import sync_directory
from rigctl.runwriter import lock_part

__all__ = ["PartFile", "PartMark", "part_files", "remove_part"]

_SUFFIX: Final = ".part"


class PartFile:
    """Made by its constructor; ``name_it`` or ``discard`` ends it."""

    def __init__(self, folder: Path, name: str) -> None:
        self.path, self.final, self.size = folder / f"{name}{_SUFFIX}", folder / name, 0
        self._digest = hashlib.sha256()
        folder.mkdir(parents=True)
        try:
            self._file = self.path.open("xb")
        except OSError:
            folder.rmdir()
            raise
        lock_part(self._file.fileno(), exclusive=False)  # HDF5 takes a shared lock itself when the file is read

    @property
    def sha256(self) -> str:
        return self._digest.hexdigest()

    def write(self, content: bytes) -> None:
        self._file.write(content)
        self._digest.update(content)
        self.size += len(content)

    def sync(self) -> None:
        """Force it to the disk."""
        self._file.flush()
        os.fsync(self._file.fileno())

    def name_it(self) -> None:
        """Give it its name."""
        self.path.replace(self.final)
        sync_directory(self.final.parent)
        self._close()

    def discard(self) -> None:
        """Remove every trace; no error where it has been named already."""
        self._close()
        remove_part(self.path)

    def _close(self) -> None:
        with suppress(OSError):  # a full disk, once more
            self._file.close()


class PartMark:
    """An empty file ``NAME.part`` beside ``NAME``, a folder that is being written; its lock is held until it ends.

    A child process that is given ``handle`` holds the lock too, also where the process that made it has died.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._path = folder, folder.with_name(folder.name + _SUFFIX)
        folder.mkdir(parents=True, exist_ok=True)
        self._file = self._path.open("wb")
        lock_part(self._file.fileno(), exclusive=False)

    @property
    def handle(self) -> int:
        return self._file.fileno()

    def end(self, *, keep: bool) -> None:
        """The folder is whole and stays, or it is removed."""
        if not keep:
            rmtree(self._folder, ignore_errors=True)
        self._path.unlink(missing_ok=True)
        self._file.close()


def part_files(folder: Path, pattern: str) -> list[Path]:
    """Those that no live process writes; ``pattern`` of where they lie, for example ``*/*``."""
    return [path for path in sorted(folder.glob(f"{pattern}{_SUFFIX}")) if not _is_written(path)]


def remove_part(path: Path) -> None:
    """Remove a file and its folder, where nothing else is in it."""
    path.unlink(missing_ok=True)
    with suppress(OSError):
        path.parent.rmdir()


def _is_written(path: Path) -> bool:
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return True
    try:
        return not lock_part(handle, exclusive=True)
    finally:
        os.close(handle)
