"""The clock of the database: one clock for all services that share it, independent of the clocks of their hosts."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Float
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.functions import FunctionElement

__all__ = ["now"]


def now() -> ColumnElement[float]:
    """Seconds since 1970, UTC, on the database's clock at the moment at which the statement runs."""
    return _Now()


class _Now(FunctionElement[float]):
    type = Float()
    inherit_cache = True


# Any: SQLAlchemy does not type what it gives to a compiler function
@compiles(_Now, "sqlite")
def _sqlite(element: Any, compiler: Any, **options: Any) -> str:
    return "((julianday('now') - 2440587.5) * 86400.0)"  # a Julian day resolves 40 µs; 2440587.5 is 1970-01-01


@compiles(_Now, "postgresql")
def _postgresql(element: Any, compiler: Any, **options: Any) -> str:
    # now() of PostgreSQL stands still in a transaction that waits for a lock
    return "CAST(extract(epoch FROM clock_timestamp()) AS double precision)"
