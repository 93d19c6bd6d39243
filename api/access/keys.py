"""The keys in the store: made, listed, revoked. A key itself is nowhere: only its digest is."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Row, insert, select, update

from api.access.scopes import Scope
from api.access.tokens import digest_of_key, new_key
from api.errors import InputError, NotFound
from api.store.clock import now
from api.store.database import Database
from api.store.tables import keys

__all__ = ["KeyRecord", "KeyStore"]

_LONGEST_NAME = 100
_LONGEST_DAYS = 3650.0


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyRecord:
    """What may be shown of a key; times in seconds since 1970 on the database's clock."""

    id: str
    name: str
    scope: Scope
    created_at_s: float
    created_by: str
    expires_at_s: float | None
    used_at_s: float | None
    revoked_at_s: float | None


class KeyStore:
    """The table of keys; every call raises StoreError where the store does not answer."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(self, name: str, scope: Scope, *, expires_days: float | None, created_by: str) -> tuple[KeyRecord, str]:
        """A new key and its text, which cannot be had again. ``expires_days`` None: it does not expire.

        Raises InputError where the name or the days cannot be.
        """
        name = _checked_name(name)
        if expires_days is not None and not 0 < expires_days <= _LONGEST_DAYS:
            raise InputError(f"expires after {expires_days:g} days: it must be more than 0, at most {_LONGEST_DAYS:g}")
        key_id, secret, text = new_key()
        ends = None if expires_days is None else now() + expires_days * 86400.0
        row = insert(keys).values(
            id=key_id,
            name=name,
            scope=scope.value,
            digest=digest_of_key(key_id, secret),
            created_at_s=now(),
            created_by=created_by,
            expires_at_s=ends,
        )
        with self._database.writing() as connection:
            connection.execute(row)
            made = connection.execute(select(keys).where(keys.c.id == key_id)).one()
        return _record(made), text

    def every(self) -> tuple[KeyRecord, ...]:
        """All keys, also revoked and expired ones, the oldest first."""
        with self._database.reading() as connection:
            rows = connection.execute(select(keys).order_by(keys.c.created_at_s, keys.c.id)).all()
        return tuple(map(_record, rows))

    def any_made(self) -> bool:
        """Whether a key was ever made: from then on a key is needed, also when all are revoked."""
        with self._database.reading() as connection:
            return connection.execute(select(keys.c.id).limit(1)).first() is not None

    def revoke(self, key_id: str) -> KeyRecord:
        """Revoke a key; no error if it is revoked already. Raises NotFound."""
        with self._database.writing() as connection:
            connection.execute(
                update(keys).where(keys.c.id == key_id, keys.c.revoked_at_s.is_(None)).values(revoked_at_s=now())
            )
            found = connection.execute(select(keys).where(keys.c.id == key_id)).first()
        if found is None:
            raise NotFound(f"there is no key {key_id!r:.40}: damper-rig key list and GET /v1/keys list their ids")
        return _record(found)


def _checked_name(name: str) -> str:
    if not (name.strip() and name.isprintable() and len(name) <= _LONGEST_NAME):
        raise InputError(f"name is {name!a:.60}: it must be 1 … {_LONGEST_NAME} printable characters")
    return name.strip()


def _record(row: Row[tuple[object, ...]]) -> KeyRecord:
    values = dict(row._mapping)
    del values["digest"]
    return KeyRecord(**{**values, "scope": Scope(row.scope)})
