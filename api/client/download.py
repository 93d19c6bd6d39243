"""A run file from the service: resumed where an earlier download ended, checked, and on the disk whole or not there."""

from __future__ import annotations

import re
from collections.abc import Callable
from hashlib import file_digest
from pathlib import Path

from api.client.answers import RunFile
from api.client.connection import Connection
from api.errors import InputError, ServiceError
from excitation.atomic import sync_directory, sync_file

__all__ = ["download", "file_name"]

_ATTEMPTS = 5  # connections that may break in one download
_PART = 2**18  # bytes that are written at once


def file_name(run: RunFile) -> str:
    """A name for a run file that is safe on every system: the name of its test."""
    return (re.sub(r"[^A-Za-z0-9.-]+", "_", run.test).strip("._") or "run") + ".h5"


def download(connection: Connection, run: RunFile, to: Path, *, tell: Callable[[float], None]) -> None:
    """Bring a run file to ``to``; what is there already with the right content stays. ``tell`` gets the share done.

    Raises InputError where another file is there or the folder cannot be written, ServiceError where the content is
    not what the service recorded, or the service does not answer; the part that came is then kept for the next time.
    """
    if to.exists():
        if _sha256(to) == run.sha256:
            tell(1.0)
            return
        raise InputError(f"{to}: is another file: give a new folder")
    part = to.with_name(f".{to.name}.{run.sha256[:16]}.part")
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        _complete(connection, run, part, tell)
        if _sha256(part) != run.sha256:
            part.unlink()
            raise ServiceError(f"{run.file}: its content is not what the service recorded: nothing was kept")
        sync_file(part)
        part.replace(to)
        sync_directory(to.parent)
    except OSError as error:
        raise InputError(f"{to}: cannot be written ({error.strerror or error}): give another folder") from error


def _complete(connection: Connection, run: RunFile, part: Path, tell: Callable[[float], None]) -> None:
    """Append to the part until it has all bytes."""
    for attempt in range(_ATTEMPTS):
        here = part.stat().st_size if part.exists() else 0
        if here > run.size_bytes:
            part.unlink()
            here = 0
        if here == run.size_bytes and part.exists():
            return
        try:
            _append(connection, run, part, here, tell)
        except ServiceError:
            if attempt == _ATTEMPTS - 1:
                raise
    if part.stat().st_size != run.size_bytes:
        raise ServiceError(f"{run.file}: the service sends {part.stat().st_size} of {run.size_bytes} bytes")


def _append(connection: Connection, run: RunFile, part: Path, here: int, tell: Callable[[float], None]) -> None:
    headers = {"accept-encoding": "identity"} | ({"range": f"bytes={here}-"} if here else {})
    with connection.stream(run.file, headers) as response:
        ranged = response.status_code == 206
        with part.open("ab" if ranged else "wb") as file:
            size = here if ranged else 0
            for piece in response.iter_raw(_PART):
                file.write(piece)
                size += len(piece)
                tell(min(1.0, size / run.size_bytes))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
