"""Leases on rigs and jobs: the right of one holder to a resource, as long as the holder renews it.

A lease is a row. Its holder renews it in the transaction of everything that it writes, so that no two holders write
about one resource. Whoever wants it takes it over when it has seen no renewal for the length of the lease, on its own
steady clock: no wall clock, the database's included, ends a lease or keeps that of a dead holder.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from sqlalchemy import ColumnElement, Connection, Row, delete, select, update
from sqlalchemy.dialects import postgresql, sqlite

from api.errors import LeaseLost
from api.store.database import Database
from api.store.sightings import Sightings
from api.store.tables import leases

__all__ = ["Lease", "acquire", "holders", "new_owner", "release", "renew", "writing_as_holder"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lease:
    """The right of ``owner`` to ``resource``; ``token`` is new with every holder."""

    resource: str
    owner: str
    token: str
    length_s: float


def new_owner() -> str:
    """A name that is different for every call in every process."""
    return f"{socket.gethostname()}:{os.getpid()}:{uuid4().hex[:8]}"


def acquire(connection: Connection, sightings: Sightings, resource: str, owner: str, length_s: float) -> Lease | None:
    """The lease, where nobody holds it or it is dead; else None."""
    lease = Lease(resource=resource, owner=owner, token=uuid4().hex, length_s=length_s)
    values = {"owner": owner, "token": lease.token, "renewals": 0, "length_s": length_s}
    row = connection.execute(select(leases).where(leases.c.resource == resource)).one_or_none()
    if row is None:
        insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
        made = insert(leases).values(resource=resource, **values).on_conflict_do_nothing().returning(leases.c.token)
        return lease if connection.scalar(made) is not None else None
    if not _is_dead(row, sightings):
        return None
    unchanged = (leases.c.token == row.token) & (leases.c.renewals == row.renewals)
    taken = connection.execute(update(leases).where(leases.c.resource == resource, unchanged).values(**values))
    return lease if taken.rowcount == 1 else None


def renew(connection: Connection, lease: Lease) -> None:
    """Renew the lease; its row then stays locked until the end of this transaction.

    A lease that was renewed late is still held where nobody took it. Raises LeaseLost where another worker has.
    """
    values = {"renewals": leases.c.renewals + 1, "length_s": lease.length_s}
    if connection.execute(update(leases).where(_mine(lease)).values(**values)).rowcount != 1:
        raise LeaseLost(f"{lease.resource}: another worker holds its lease")


@contextmanager
def writing_as_holder(database: Database, lease: Lease) -> Iterator[Connection]:
    """One transaction that first renews the lease; raises LeaseLost, and then nothing is written."""
    with database.writing() as connection:
        renew(connection, lease)
        yield connection


def release(connection: Connection, lease: Lease) -> None:
    """Release the lease, so that another worker can take it. No error if it is lost already."""
    connection.execute(delete(leases).where(_mine(lease)))


def holders(connection: Connection, sightings: Sightings) -> dict[str, str]:
    """The owner of every resource that is held, as far as this process has seen."""
    rows = connection.execute(select(leases)).all()
    sightings.forget_all_but(frozenset(row.resource for row in rows))
    return {row.resource: row.owner for row in rows if not _is_dead(row, sightings)}


def _is_dead(row: Row[Any], sightings: Sightings) -> bool:
    # Any: SQLAlchemy's rows know their columns only when they run
    unchanged_s = sightings.unchanged_s(row.resource, (row.token, row.renewals))
    return bool(unchanged_s >= row.length_s)


def _mine(lease: Lease) -> ColumnElement[bool]:
    return (leases.c.resource == lease.resource) & (leases.c.token == lease.token)
