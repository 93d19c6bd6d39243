"""A file is there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from excitation.errors import ExcitationFileError

__all__ = ["written_whole"]


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path``, of the same ending, that takes its place when the block ends well.

    Raises ExcitationFileError where the folder cannot be written.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise ExcitationFileError(f"{path}: {error.strerror or error}: give a place that can be written") from error
    finally:
        temporary.unlink(missing_ok=True)
