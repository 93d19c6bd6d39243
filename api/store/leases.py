"""Leases on rigs and jobs: the right of one holder to a resource, as long as the holder renews it.

A lease is a row. Its holder renews it in the transaction of everything that it writes, so that no two holders write
about one resource. Times are the database's own: the clocks of two hosts may differ.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from uuid import uuid4

from sqlalchemy import ColumnElement, Connection, delete, exists, select, update
from sqlalchemy.dialects import postgresql, sqlite

from api.errors import LeaseLost
from api.store.clock import now
from api.store.database import Database
from api.store.tables import leases

__all__ = ["Lease", "acquire", "holders", "is_held", "new_owner", "release", "renew", "writing_as_holder"]


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


def acquire(connection: Connection, resource: str, owner: str, length_s: float) -> Lease | None:
    """The lease, where nobody holds it or it has expired; else None."""
    lease = Lease(resource=resource, owner=owner, token=uuid4().hex, length_s=length_s)
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    values = {"owner": owner, "token": lease.token, "expires_at_s": now() + length_s}
    taken = (
        insert(leases)
        .values(resource=resource, **values)
        .on_conflict_do_update(index_elements=[leases.c.resource], set_=values, where=leases.c.expires_at_s <= now())
        .returning(leases.c.token)
    )
    return lease if connection.scalar(taken) == lease.token else None


def renew(connection: Connection, lease: Lease) -> None:
    """Extend the lease; its row then stays locked until the end of this transaction.

    An expired lease that nobody took is still held. Raises LeaseLost where another worker has taken it.
    """
    values = {"expires_at_s": now() + lease.length_s}
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


def is_held(resource: ColumnElement[str]) -> ColumnElement[bool]:
    """Whether somebody holds the lease on a resource, for a query."""
    return exists(select(leases.c.token).where(leases.c.resource == resource, leases.c.expires_at_s > now()))


def holders(connection: Connection) -> dict[str, str]:
    """The owner of every resource that is held."""
    rows = connection.execute(select(leases.c.resource, leases.c.owner).where(leases.c.expires_at_s > now()))
    return {row.resource: row.owner for row in rows}


def _mine(lease: Lease) -> ColumnElement[bool]:
    return (leases.c.resource == lease.resource) & (leases.c.token == lease.token)
