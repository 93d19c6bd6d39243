"""From a backup to an empty store: everything is checked before the store has any of it."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from shutil import rmtree

from sqlalchemy import Connection, delete, inspect

from api.errors import InputError
from api.store.archive import FileEntry, Manifest, copy_hashed, opened, read_lines
from api.store.backup import Folders
from api.store.database import Database
from api.store.rows import Digest, insert_rows, kept_tables, table_digest
from api.store.tables import leases
from excitation.atomic import sync_directory, sync_file

__all__ = ["restore", "verify"]


def verify(path: Path, *, tell: Callable[[float, str], None]) -> Manifest:
    """Read a backup whole; returns its manifest, or raises InputError, one line, where anything is not as it says."""
    with opened(path) as (archive, manifest):
        for name, entry in manifest.tables.items():
            digest = Digest()
            for line in read_lines(archive, name):
                digest.add(line)
            if (digest.rows, str(digest)) != (entry.rows, entry.digest):
                raise InputError(f"{path}: table {name} is damaged: use another backup")
        for number, file in enumerate(manifest.files):
            tell(number / len(manifest.files), file.path)
            if file.included:
                _copy(archive, file, None)
        return manifest


def restore(path: Path, url: str, folders: Folders, *, tell: Callable[[float, str], None]) -> Manifest:
    """Fill an empty store from a backup of any database and bring its schema to this program's version.

    All of it is in the store at the end, or nothing. Raises InputError where the backup is damaged or the store is not
    empty, NewerStore where a later version of this program made the backup, StoreError where the database fails.
    """
    manifest = verify(path, tell=tell)
    includes = any(file.included for file in manifest.files)
    with Database(url, migrates=False) as database, opened(path) as (archive, _):
        with database.snapshot() as connection:
            _check_empty(connection, database.place)
        kept: list[Path] = []
        try:
            if includes:
                _unpack(archive, manifest, folders, tell)
            with database.writing() as connection:
                _check_empty(connection, database.place)
                _fill(connection, database, archive, manifest)
                if includes:
                    kept = _move_in(folders)
        except BaseException:
            for folder in kept:
                rmtree(folder, ignore_errors=True)
            raise
        finally:
            for folder in (folders.runs, folders.results):
                rmtree(_waiting(folder), ignore_errors=True)
    return manifest


def _check_empty(connection: Connection, place: str) -> None:
    names = inspect(connection).get_table_names()
    if names:
        raise InputError(f"{place}: is not empty (it has {', '.join(sorted(names)[:3])}, …): give an empty database")


def _fill(connection: Connection, database: Database, archive: zipfile.ZipFile, manifest: Manifest) -> None:
    """Build the schema of the backup, insert its rows, compare what the database then has, and migrate forward."""
    database.migrate(connection, manifest.schema)
    tables = {table.name: table for table in kept_tables(connection)}
    if set(tables) != set(manifest.tables):
        other = sorted(set(tables) ^ set(manifest.tables))
        raise InputError(f"the backup has other tables than schema {manifest.schema}: {', '.join(other)}")
    for name, table in tables.items():
        insert_rows(connection, table, read_lines(archive, name))
    for name, table in tables.items():
        if str(table_digest(connection, table)) != manifest.tables[name].digest:
            raise InputError(f"table {name} differs from the backup after its restoration: nothing was kept")
    database.migrate(connection)
    connection.execute(delete(leases))  # an earlier schema keeps them elsewhere; their holders work on another store


def _unpack(archive: zipfile.ZipFile, manifest: Manifest, folders: Folders, tell: Callable[[float, str], None]) -> None:
    for folder in (folders.runs, folders.results):
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: is not empty: give a new folder with --data")
    waiting = Folders(_waiting(folders.runs), _waiting(folders.results))
    for number, file in enumerate(manifest.files):
        tell(number / len(manifest.files), file.path)
        if file.included:
            place = waiting.place(file.path)
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                _copy(archive, file, place)
                sync_file(place)
            except OSError as error:
                raise InputError(f"{place}: cannot be written ({error.strerror}): give another folder") from error


def _copy(archive: zipfile.ZipFile, file: FileEntry, to: Path | None) -> None:
    with archive.open(file.path) as source:
        if to is None:
            found = copy_hashed(source, None)
        else:
            with to.open("xb") as target:
                found = copy_hashed(source, target)
    if found != (file.size_bytes, file.sha256):
        raise InputError(f"{file.path} is damaged in the backup: use another backup")


def _move_in(folders: Folders) -> list[Path]:
    moved = []
    for folder in (folders.runs, folders.results):
        waiting = _waiting(folder)
        if waiting.exists():
            with suppress(FileNotFoundError):
                folder.rmdir()  # it is empty
            waiting.rename(folder)
            sync_directory(folder.parent)
            moved.append(folder)
    return moved


def _waiting(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.restoring")
