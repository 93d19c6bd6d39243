"""Whether a store is whole: its database, and every file that its rows name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy import Connection, text

from api.errors import InputError
from api.store.archive import copy_hashed
from api.store.backup import Folders, NamedFile, check_exists, named_files
from api.store.database import Database
from api.store.rows import kept_tables, revision

__all__ = ["Checked", "check"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """What was looked at, and what is wrong."""

    schema: str
    rows: int
    files: int
    trouble: tuple[str, ...]


def check(url: str, folders: Folders, *, tell: Callable[[float, str], None]) -> Checked:
    """Read a store whole, which may be in use, and change nothing.

    Raises InputError where there is no store, StoreError where the database does not answer.
    """
    check_exists(url)
    with Database(url, migrates=False) as database, database.snapshot() as connection:
        schema = revision(connection)
        if schema is None:
            raise InputError(f"{database.place}: there is no store of damper-rig")
        tables = kept_tables(connection)
        trouble = _database_trouble(connection)
        rows = sum(connection.scalar(text(f'SELECT count(*) FROM "{table.name}"')) or 0 for table in tables)
        named = tuple(named_files(connection, tables, folders))
    for number, one in enumerate(named):
        tell(number / len(named), one.path)
        trouble += _file_trouble(one, folders)
    return Checked(schema=schema, rows=rows, files=len(named), trouble=tuple(trouble))


def _database_trouble(connection: Connection) -> list[str]:
    """What SQLite finds in its own file; PostgreSQL checks its pages itself."""
    if connection.dialect.name != "sqlite":
        return []
    found = [str(row[0]) for row in connection.execute(text("PRAGMA integrity_check")) if row[0] != "ok"]
    found += [
        f"a row of {row[0]} refers to none of {row[2]}" for row in connection.execute(text("PRAGMA foreign_key_check"))
    ]
    return found


def _file_trouble(one: NamedFile, folders: Folders) -> list[str]:
    try:
        with folders.place(one.path).open("rb") as file:
            wrong = one.trouble(*copy_hashed(file, None))
    except FileNotFoundError:
        wrong = f"{one.path}: is missing"
    return [wrong] if wrong else []
