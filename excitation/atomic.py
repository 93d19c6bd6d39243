"""A file is on the disk whole, or not there: the one writer of every package."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["sync_directory", "sync_file", "written_whole"]


@contextmanager
def written_whole(path: Path, refusal: type[Exception]) -> Iterator[Path]:
    """A temporary name beside ``path``: forced to the disk and renamed where the block ends well, removed where not.

    Raises ``refusal``, the error class of the caller's package, where the place cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        sync_file(temporary)
        temporary.replace(path)
        sync_directory(path.parent)
    except OSError as error:
        reason = error.strerror or error
        raise refusal(f"{path}: cannot be written ({reason}): give a place that can be written") from error
    finally:
        temporary.unlink(missing_ok=True)


def sync_file(path: Path) -> None:
    """Force a closed file to the disk."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sync_directory(directory: Path) -> None:
    """Force a rename to the disk, where the system can (Windows cannot)."""
    if os.name == "posix":
        handle = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
