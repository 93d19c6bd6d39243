"""Many rows with one short statement: on PostgreSQL their values are one parameter, so that few bytes are parsed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import JSON, ColumnElement, Connection, Insert, Row, Table, bindparam, column, func, select

__all__ = ["ManyRows"]


class ManyRows:
    """An INSERT into some columns of a table."""

    def __init__(
        self,
        table: Table,
        names: Sequence[str],
        *,
        computed: Mapping[str, ColumnElement[Any]] | None = None,
        returning: Sequence[str] = (),
    ) -> None:
        """``computed``: what the database itself fills into further columns. Any: values of any type of column."""
        self._plain = _returning(table.insert().values(**computed or {}), table, returning)
        self._from_json = _returning(_insert_json(table, names, computed or {}), table, returning)
        self._returns = bool(returning)

    def insert(self, connection: Connection, rows: Sequence[Mapping[str, Any]]) -> Sequence[Row[Any]]:
        """Insert rows, each with all of ``names``; returns the columns of ``returning``, in any order. Any: JSON."""
        if connection.dialect.name == "postgresql":
            done = connection.execute(self._from_json, {"rows": list(rows)})
        else:
            done = connection.execute(self._plain, list(rows))
        return done.all() if self._returns else ()


def _insert_json(table: Table, names: Sequence[str], computed: Mapping[str, ColumnElement[Any]]) -> Insert:
    typed = [column(name, table.c[name].type) for name in names]
    records = func.json_to_recordset(bindparam("rows", type_=JSON)).table_valued(*typed).render_derived(with_types=True)
    values = select(*(records.c[name] for name in names), *computed.values())
    return table.insert().from_select([*names, *computed], values)


def _returning(insert: Insert, table: Table, names: Sequence[str]) -> Any:
    # Any: with RETURNING it is a statement of another type
    return insert.returning(*(table.c[name] for name in names)) if names else insert
