"""Designs that campaigns can name: the tests of a plan, stored once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from sqlalchemy import Row, delete, insert, or_, select

from api.errors import Conflict, NotFound
from api.store.clock import now
from api.store.database import Database
from api.store.tables import designs

__all__ = ["Design", "DesignStore"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """A stored design; ``tests`` and ``warm_up`` are configurations (JSON), as a campaign has them."""

    number: int
    id: str
    name: str
    tests: tuple[Mapping[str, Any], ...]
    warm_up: Mapping[str, Any] | None
    duration_s: float
    sha256: str
    created_at_s: float


class DesignStore:
    """Designs in the database, by id or name. Safe to use from many threads."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(
        self, name: str, tests: Sequence[Mapping[str, Any]], warm_up: Mapping[str, Any] | None, duration_s: float
    ) -> Design:
        """Store a design; raises Conflict where the name is taken."""
        content = json.dumps({"tests": list(tests), "warm_up": warm_up}, sort_keys=True)
        row = insert(designs).values(
            id=uuid4().hex,
            name=name,
            tests=list(tests),
            warm_up=warm_up,
            duration_s=duration_s,
            sha256=hashlib.sha256(content.encode()).hexdigest(),
            created_at_s=now(),
        )
        with self._database.writing() as connection:
            if connection.scalar(select(designs.c.id).where(designs.c.name == name)) is not None:
                raise Conflict(f"there is a design {name!r:.60} already: choose another name, or delete it first")
            return _design(connection.execute(row.returning(*designs.c)).one())

    def one(self, name: str) -> Design:
        """The design with this id or name; raises NotFound."""
        with self._database.reading() as connection:
            query = select(designs).where(or_(designs.c.id == name, designs.c.name == name))
            row = connection.execute(query.order_by(designs.c.id != name).limit(1)).one_or_none()
        if row is None:
            raise NotFound(f"there is no design {name!r:.60}: GET /v1/designs lists them")
        return _design(row)

    def newest(self, *, limit: int, before: int | None = None) -> tuple[Design, ...]:
        """The newest first; ``before``: only those of lower numbers."""
        query = select(designs).order_by(designs.c.number.desc()).limit(limit)
        if before is not None:
            query = query.where(designs.c.number < before)
        with self._database.reading() as connection:
            return tuple(map(_design, connection.execute(query)))

    def delete(self, name: str) -> Design:
        """Delete a design by id or name, and return it; campaigns keep their own copy. Raises NotFound."""
        with self._database.together() as connection:
            found = self.one(name)
            connection.execute(delete(designs).where(designs.c.id == found.id))
            return found


def _design(row: Row[Any]) -> Design:
    # Any: SQLAlchemy's rows know their columns only when they run
    values = {name: getattr(row, name) for name in Design.__slots__}
    return Design(**{**values, "tests": tuple(row.tests)})
