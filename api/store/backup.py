"""A backup of a store in use: the database at one moment, and the run and result files that its rows name."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from sqlalchemy import Connection, Table, make_url, select

from api.errors import InputError
from api.store.archive import FORMAT, MANIFEST, FileEntry, Manifest, TableEntry, copy_hashed, table_member
from api.store.database import Database
from api.store.rows import Digest, kept_tables, read_rows, revision
from excitation.atomic import written_whole

__all__ = ["Folders", "NamedFile", "back_up", "check_exists", "named_files"]


@dataclass(frozen=True, slots=True)
class Folders:
    """Where the run files and the files of results are kept."""

    runs: Path
    results: Path

    def place(self, path: str) -> Path:
        """Where the file with this path in a backup is."""
        kind, _, below = path.partition("/")
        return {"runs": self.runs, "reports": self.results}[kind] / below


@dataclass(frozen=True, slots=True)
class NamedFile:
    """A file that a row of the store names; no size and hash where the row states none."""

    path: str
    size_bytes: int | None = None
    sha256: str | None = None

    def trouble(self, size_bytes: int, sha256: str) -> str:
        """What is wrong with a file of this size and hash; empty: nothing."""
        if self.sha256 is not None and (size_bytes, sha256) != (self.size_bytes, self.sha256):
            return f"{self.path}: its content is not what the store recorded"
        return ""


def back_up(
    url: str, folders: Folders, to: Path, *, with_files: bool = True, tell: Callable[[float, str], None]
) -> Manifest:
    """Write a backup of a store, which may be in use: a whole file or none, which only its owner can read.

    ``with_files=False``: run and result files are listed with their SHA-256, not copied. ``tell`` gets the share done.

    Raises InputError where there is no store or the file cannot be written, StoreError where the database fails.
    """
    check_exists(url)
    if to.exists():
        raise InputError(f"{to}: exists already: give a new name")
    with Database(url, migrates=False) as database, written_whole(to, InputError) as temporary:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            with database.snapshot() as connection:
                schema = revision(connection)
                if schema is None:
                    raise InputError(f"{database.place}: there is no store of damper-rig")
                tables = kept_tables(connection)
                entries = {table.name: _write_table(connection, table, archive) for table in tables}
                named = tuple(named_files(connection, tables, folders))
            files, trouble = _write_files(archive, named, folders, with_files, tell)
            manifest = Manifest(
                format=FORMAT,
                version=version("damper-rig"),
                schema=schema,
                database=database.engine.dialect.name,
                created=datetime.now(UTC).isoformat(timespec="seconds"),
                tables=entries,
                files=files,
                trouble=trouble,
            )
            archive.writestr(MANIFEST, manifest.to_json())
    return manifest


def check_exists(url: str) -> None:
    """Raise InputError where the URL names an SQLite file that is not there: opening it would make it."""
    parts = make_url(url)
    if parts.get_backend_name() == "sqlite" and not (parts.database and Path(parts.database).is_file()):
        raise InputError(f"{parts.database}: there is no store: give its folder with --data, or --database")


def named_files(connection: Connection, tables: Sequence[Table], folders: Folders) -> Iterator[NamedFile]:
    """Every file that the rows name: captured and uploaded runs, and the files of results that are done."""
    for table in tables:
        if {"location", "size_bytes", "sha256"} <= set(table.c.keys()):
            for row in connection.execute(select(table.c.location, table.c.size_bytes, table.c.sha256)):
                yield NamedFile(f"runs/{row.location}", row.size_bytes, row.sha256)
        elif table.name in ("jobs", "explanations"):  # the second is what the first was before revision 0006
            for job_id in connection.scalars(select(table.c.id).where(table.c.state == "done")):
                for path in sorted((folders.results / job_id).rglob("*")):
                    if path.is_file():
                        yield NamedFile(f"reports/{path.relative_to(folders.results).as_posix()}")


def _write_table(connection: Connection, table: Table, archive: zipfile.ZipFile) -> TableEntry:
    digest = Digest()
    with archive.open(table_member(table.name), "w", force_zip64=True) as member:
        for line in read_rows(connection, table):
            digest.add(line)
            member.write(f"{line}\n".encode())
    return TableEntry(rows=digest.rows, digest=str(digest))


def _write_files(
    archive: zipfile.ZipFile,
    named: Sequence[NamedFile],
    folders: Folders,
    with_files: bool,
    tell: Callable[[float, str], None],
) -> tuple[tuple[FileEntry, ...], tuple[str, ...]]:
    entries, trouble = [], []
    for number, one in enumerate(named):
        tell(number / len(named), one.path)
        try:
            size, sha256 = _write_file(archive, folders.place(one.path), one.path if with_files else None)
        except FileNotFoundError:
            trouble.append(f"{one.path}: is missing")
            continue
        entries.append(FileEntry(path=one.path, size_bytes=size, sha256=sha256, included=with_files))
        if wrong := one.trouble(size, sha256):
            trouble.append(wrong)
    return tuple(entries), tuple(trouble)


def _write_file(archive: zipfile.ZipFile, path: Path, name: str | None) -> tuple[int, str]:
    """Copy a file into the archive, or only read it; HDF5 files are compressed already."""
    with path.open("rb") as source:
        if name is None:
            return copy_hashed(source, None)
        with archive.open(zipfile.ZipInfo(name), "w", force_zip64=True) as member:
            return copy_hashed(source, member)
