"""The file of a backup: a ZIP archive with a manifest, a file of JSON lines for each table, and run and result files.

A half-written archive has no directory at its end and is refused; every member has a SHA-256 in the manifest.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import IO, Any, ClassVar
from zlib import error as ZlibError

from pydantic import TypeAdapter, ValidationError

from api.errors import InputError, one_line

__all__ = [
    "FORMAT",
    "MANIFEST",
    "FileEntry",
    "Manifest",
    "TableEntry",
    "copy_hashed",
    "opened",
    "read_lines",
    "table_member",
]

FORMAT = "damper-rig/backup 1"
MANIFEST = "manifest.json"
_PART = 2**20  # bytes that are copied at once


@dataclass(frozen=True, slots=True, kw_only=True)
class TableEntry:
    """One table: its rows, and the fingerprint that `rows.Digest` makes of them."""

    rows: int
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FileEntry:
    """One file below the data folder; ``included``: it is in the archive."""

    path: str  # "runs/…" or "reports/…"
    size_bytes: int
    sha256: str
    included: bool

    def __post_init__(self) -> None:
        parts = PurePosixPath(self.path).parts
        if len(parts) < 2 or parts[0] not in ("runs", "reports") or ".." in parts or "\\" in self.path:
            raise InputError(f"a file of a backup is {self.path!r:.80}: it must lie in runs/ or reports/")


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a backup holds. ``trouble``: what was not as its record says when the backup was made."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    format: str
    version: str  # of the program
    schema: str  # revision
    database: str  # kind of database that it was made from
    created: str
    tables: dict[str, TableEntry]
    files: tuple[FileEntry, ...]
    trouble: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.format != FORMAT:
            raise InputError(f"its format is {self.format!r:.60}: it must be {FORMAT!r}")

    def to_json(self) -> bytes:
        return _MANIFEST.dump_json(self, indent=1)


_MANIFEST = TypeAdapter(Manifest)


@contextmanager
def opened(path: Path) -> Iterator[tuple[zipfile.ZipFile, Manifest]]:
    """A backup for reading; raises InputError, one line, where it is no backup, damaged or half-written."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive, _MANIFEST.validate_json(archive.read(MANIFEST))
    except ValidationError as error:
        raise InputError(f"{path}: its manifest cannot be used: {one_line(error)}") from error
    except (zipfile.BadZipFile, ZlibError, EOFError, KeyError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is no whole backup ({one_line(error)}): use another one") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {one_line(error)}") from error


def table_member(name: str) -> str:
    return f"tables/{name}.jsonl"


def read_lines(archive: zipfile.ZipFile, table: str) -> Iterator[str]:
    """The rows of a table, as `rows.read_rows` wrote them."""
    with archive.open(table_member(table)) as file:
        for line in file:
            yield line.decode().rstrip("\n")


def copy_hashed(source: IO[bytes], target: IO[bytes] | None) -> tuple[int, str]:
    """Copy all bytes, or only read them; returns their number and SHA-256."""
    size, digest = 0, sha256()
    while part := source.read(_PART):
        size += len(part)
        digest.update(part)
        if target is not None:
            target.write(part)
    return size, digest.hexdigest()
