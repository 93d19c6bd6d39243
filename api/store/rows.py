"""The rows of a store of any revision as JSON, and back: what a backup holds of the database.

Tables are read by reflection, so that a store of an earlier version of this program can be kept before it is migrated.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import islice
from typing import Any

from sqlalchemy import JSON, Column, Connection, Integer, MetaData, Table, event, func, insert, inspect, select, text

__all__ = ["NOT_KEPT", "Digest", "insert_rows", "kept_tables", "read_rows", "revision", "table_digest"]

# The revision stands in the backup; holders of leases and people who were signed in are not restored.
NOT_KEPT = ("alembic_version", "leases", "sessions")
_ROWS = 200  # of a table in memory at once


@dataclass(slots=True)
class Digest:
    """A fingerprint of rows that does not depend on their order: the sum of the SHA-256 of each, modulo 2²⁵⁶."""

    rows: int = 0
    total: int = 0

    def add(self, line: str) -> None:
        self.rows += 1
        self.total = (self.total + int.from_bytes(sha256(line.encode()).digest())) % 2**256

    def __str__(self) -> str:
        return f"{self.total:064x}"


def revision(connection: Connection) -> str | None:
    """The revision of the schema; None where there is none."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found: str | None = connection.scalar(text("SELECT version_num FROM alembic_version"))
    return found


def kept_tables(connection: Connection) -> list[Table]:
    """The tables that a backup holds as they are in the database, each after those that it refers to."""
    metadata = MetaData()
    event.listen(metadata, "column_reflect", _null_is_null)
    metadata.reflect(connection)
    return [table for table in metadata.sorted_tables if table.name not in NOT_KEPT]


def read_rows(connection: Connection, table: Table) -> Iterator[str]:
    """Every row as one line of JSON with sorted keys; few are in memory at once."""
    for row in connection.execute(select(table).execution_options(yield_per=_ROWS)).mappings():
        yield json.dumps(dict(row), sort_keys=True)


def insert_rows(connection: Connection, table: Table, lines: Iterable[str]) -> None:
    """Insert rows as `read_rows` gives them; numbers that the database chooses continue after them."""
    ahead = iter(lines)
    while rows := [json.loads(line) for line in islice(ahead, _ROWS)]:
        connection.execute(insert(table), rows)
    if connection.dialect.name == "postgresql":
        for column in table.primary_key:
            _continue_after(connection, column)


def table_digest(connection: Connection, table: Table, seen: Callable[[str], None] = lambda line: None) -> Digest:
    """The fingerprint of a table; ``seen`` gets every line."""
    digest = Digest()
    for line in read_rows(connection, table):
        digest.add(line)
        seen(line)
    return digest


def _continue_after(connection: Connection, column: Column[Any]) -> None:
    """Any: a reflected column has the type that the database reports."""
    if not isinstance(column.type, Integer) or column.server_default is None:
        return
    sequence = func.pg_get_serial_sequence(column.table.name, column.name)
    largest = select(func.max(column)).scalar_subquery()
    connection.execute(select(func.setval(sequence, largest)).where(largest.is_not(None)))


def _null_is_null(inspector: object, table: Table, column: Any) -> None:
    """NULL of a JSON column stays NULL and is not the text null. Any: the reflected column as SQLAlchemy gives it."""
    if isinstance(column["type"], JSON):
        column["type"] = JSON(none_as_null=True)
