"""Stored model files, as the one reader of models has accepted them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from sqlalchemy import Row, delete, insert, select

from api.errors import NotFound
from api.store.clock import now
from api.store.database import Database
from api.store.tables import models

__all__ = ["ModelStore", "StoredModel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredModel:
    """One model file; ``content`` is its JSON."""

    number: int
    id: str
    name: str
    kind: str
    content: str
    sha256: str
    created_at_s: float


class ModelStore:
    """Model files in the database. Safe to use from many threads."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(self, *, name: str, kind: str, model: Mapping[str, Any]) -> StoredModel:
        """Store a model file that its reader has accepted. Any: JSON."""
        content = json.dumps(model, indent=1, ensure_ascii=False) + "\n"
        sha256 = hashlib.sha256(content.encode()).hexdigest()
        row = insert(models).values(
            id=uuid4().hex, name=name, kind=kind, content=content, sha256=sha256, created_at_s=now()
        )
        with self._database.writing() as connection:
            return _model(connection.execute(row.returning(*models.c)).one())

    def one(self, model_id: str) -> StoredModel:
        """One model; raises NotFound."""
        with self._database.reading() as connection:
            row = connection.execute(select(models).where(models.c.id == model_id)).one_or_none()
        if row is None:
            raise NotFound(f"there is no model {model_id!r:.60}: GET /v1/models lists them")
        return _model(row)

    def newest(self, *, limit: int, before: int | None = None) -> tuple[StoredModel, ...]:
        """The newest first; ``before``: only those of lower numbers."""
        query = select(models).order_by(models.c.number.desc()).limit(limit)
        if before is not None:
            query = query.where(models.c.number < before)
        with self._database.reading() as connection:
            return tuple(map(_model, connection.execute(query)))

    def delete(self, model_id: str) -> None:
        """Delete a model; jobs keep their own copy. Raises NotFound."""
        with self._database.writing() as connection:
            if connection.execute(delete(models).where(models.c.id == model_id)).rowcount != 1:
                raise NotFound(f"there is no model {model_id!r:.60}: GET /v1/models lists them")


def _model(row: Row[Any]) -> StoredModel:
    # Any: SQLAlchemy's rows know their columns only when they run
    return StoredModel(**{name: getattr(row, name) for name in StoredModel.__slots__})
