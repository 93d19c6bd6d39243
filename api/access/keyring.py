"""The keys and sessions in memory, read again every second; checks touch no store and wait for nothing."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import Any

from sqlalchemy import Connection, Row, delete, insert, select, update

from api.access.identity import Identity, Refused
from api.access.scopes import Scope
from api.access.snapshot import ABSOLUTE_S, HeldKey, HeldSession, Snapshot
from api.access.tokens import digest_of_session, new_session
from api.errors import StoreError, one_line
from api.store.clock import now
from api.store.database import Database
from api.store.tables import keys, sessions

__all__ = ["Keyring"]

LOG = logging.getLogger("damper_rig.access")

REFRESH_S = 1.0  # a revocation elsewhere must hold within 5 s; the read itself may wait for the store
USED_S = 60.0  # the store learns at most this often that a key or a session is used

_NOT_READY = Refused(status=503, detail="the service has not read its keys yet: try again in a second")


class Keyring:
    """Safe to use from many threads. While the store does not answer, what was last read holds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._database: Database | None = None
        self._snapshot: Snapshot | None = None
        self._used: dict[str, float] = {}  # id of a key, or digest of a session -> when, on the steady clock
        self._told: dict[str, float] = {}  # the same, as far as the store knows
        self._refreshing = Lock()
        self._closing = Event()
        self._thread: Thread | None = None

    def open(self, database: Database) -> None:
        """Read the keys once, then every second in the background. Raises StoreError."""
        self._database = database
        self.refresh()
        self._closing.clear()
        self._thread = Thread(target=self._run, name="keys", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    @property
    def ready(self) -> bool:
        return self._snapshot is not None

    @property
    def any_made(self) -> bool:
        return self._snapshot is not None and bool(self._snapshot.keys)

    def of_key(self, text: str) -> Identity | Refused:
        """Whose key this is."""
        snapshot, steady_s = self._snapshot, self._clock()
        if snapshot is None:
            return _NOT_READY
        found = snapshot.of_key(text, steady_s)
        if isinstance(found, Identity):
            self._used[found.key_id] = steady_s
        return found

    def of_session(self, token: str, *, touch: bool = True) -> Identity | Refused:
        """Whose session this is; ``touch``: it counts as used now."""
        snapshot, steady_s = self._snapshot, self._clock()
        if snapshot is None:
            return _NOT_READY
        digest = digest_of_session(token)
        found = snapshot.of_session(token, self._used.get(digest), steady_s)
        if isinstance(found, Identity) and touch:
            self._used[digest] = self._used[found.key_id] = steady_s
        return found

    def sign_in(self, identity: Identity) -> str:
        """The token of a new session for the holder of a key. Raises StoreError."""
        token = new_session()
        with self._store().writing() as connection:
            connection.execute(
                insert(sessions).values(
                    digest=digest_of_session(token), key_id=identity.key_id, created_at_s=now(), seen_at_s=now()
                )
            )
        self.refresh()
        return token

    def sign_out(self, token: str) -> None:
        """End a session; no error if there is none. Raises StoreError."""
        with self._store().writing() as connection:
            connection.execute(delete(sessions).where(sessions.c.digest == digest_of_session(token)))
        self.refresh()

    def refresh(self) -> None:
        """Read all keys and sessions again. Raises StoreError; then what was read before holds."""
        with self._refreshing:
            database = self._store()
            before, steady_s = self._snapshot or Snapshot(), self._clock()
            used = {name: at for name, at in list(self._used.items()) if at - self._told.get(name, -USED_S) >= USED_S}
            if used and self._snapshot is not None:
                ended = [one for one, held in before.sessions.items() if held.over(self._used.get(one), steady_s)]
                with database.writing() as connection:
                    _tell(connection, list(used), ended)
                self._told.update(used)
            with database.reading() as connection:
                snapshot = _read(connection, self._clock, before)
            self._snapshot = snapshot
            for known in (self._used, self._told):
                for name in [name for name in known if name not in snapshot.keys and name not in snapshot.sessions]:
                    known.pop(name, None)

    def _store(self) -> Database:
        assert self._database is not None  # opened before it is used
        return self._database

    def _run(self) -> None:
        while not self._closing.wait(REFRESH_S):
            try:
                self.refresh()
            except StoreError as error:
                LOG.warning("the keys cannot be read again, the last ones hold: %s", one_line(error))


def _tell(connection: Connection, used: list[str], ended: list[str]) -> None:
    connection.execute(update(keys).where(keys.c.id.in_(used)).values(used_at_s=now()))
    connection.execute(update(sessions).where(sessions.c.digest.in_(used)).values(seen_at_s=now()))
    connection.execute(delete(sessions).where(sessions.c.digest.in_(ended)))


def _read(connection: Connection, clock: Callable[[], float], before: Snapshot) -> Snapshot:
    """Everything as the store has it, on the steady clock; ``before``: as it was read before."""
    steady_s = clock()
    behind_s = steady_s - float(connection.execute(select(now())).scalar_one())
    held = {row.id: _key(row, behind_s, before.keys.get(row.id)) for row in connection.execute(select(keys))}
    open_sessions = {
        row.digest: _session(row, steady_s, behind_s, before.sessions.get(row.digest))
        for row in connection.execute(select(sessions))
        if row.key_id in held
    }
    return Snapshot(keys=held, sessions=open_sessions)


def _key(row: Row[Any], behind_s: float, before: HeldKey | None) -> HeldKey:
    # Any, here and below: SQLAlchemy's rows know their columns only when they run
    ends_s = math.inf if row.expires_at_s is None else row.expires_at_s + behind_s
    return HeldKey(
        id=row.id,
        name=row.name,
        scope=Scope(row.scope),
        digest=row.digest,
        ends_s=ends_s if before is None else min(ends_s, before.ends_s),
        revoked=row.revoked_at_s is not None,
    )


def _session(row: Row[Any], steady_s: float, behind_s: float, before: HeldSession | None) -> HeldSession:
    ends_s = min(row.created_at_s + behind_s, steady_s) + ABSOLUTE_S
    seen_s = min(row.seen_at_s + behind_s, steady_s)
    if before is not None:
        ends_s = min(ends_s, before.ends_s)
        seen_s = before.seen_s if row.seen_at_s == before.stored_s else seen_s
    return HeldSession(key_id=row.key_id, ends_s=ends_s, seen_s=seen_s, stored_s=row.seen_at_s)
