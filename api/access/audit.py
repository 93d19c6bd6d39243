"""The audit log: who did what to a rig, a queue, a campaign or a key, from where, when, and with which outcome.

An entry is noted in memory, so that nothing that stops a rig waits for the store, and is written within a tenth of a
second; while the store is away, entries wait in memory. The store's clock dates them. Each is logged as well.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass
from threading import Event, Lock, Thread

from sqlalchemy import Float, bindparam, insert, select

from api.access.tokens import redacted
from api.errors import StoreError, one_line
from api.store.clock import now
from api.store.database import Database
from api.store.tables import audit

__all__ = ["AuditEntry", "AuditRecord", "AuditTrail", "audit_page", "write_entry"]

LOG = logging.getLogger("damper_rig.audit")

# with RETURNING it is one statement for many rows, on PostgreSQL too
_INSERT = insert(audit).values(at_s=now() - bindparam("ago_s", type_=Float)).returning(audit.c.number)
WRITE_S = 0.1
_MOST_WAITING = 10_000  # entries in memory while the store is away: hours of work at a rig
_LONGEST = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditEntry:
    """One action. ``outcome`` is one line, ``status`` that of HTTP; 0 at the command line."""

    who: str
    key_id: str = ""
    address: str
    action: str
    target: str
    status: int = 0
    outcome: str = "done"

    def __post_init__(self) -> None:
        for name in ("who", "address", "action", "target", "outcome"):
            text = redacted(" ".join(ascii(getattr(self, name))[1:-1].split()))
            object.__setattr__(self, name, text[:_LONGEST])


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditRecord:
    """One action as it was stored; ``at_s`` in seconds since 1970 on the database's clock."""

    number: int
    at_s: float
    who: str
    key_id: str
    address: str
    action: str
    target: str
    status: int
    outcome: str


class AuditTrail:
    """Notes entries at once and writes them in the background; safe to use from many threads."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: deque[tuple[float, AuditEntry]] = deque()
        self._writing = Lock()
        self._database: Database | None = None
        self._closing = Event()
        self._thread: Thread | None = None

    def open(self, database: Database) -> None:
        self._database = database
        self._closing.clear()
        self._thread = Thread(target=self._run, name="audit", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Write what waits, then end."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def note(self, entry: AuditEntry) -> None:
        """Keep an entry; touches no store and waits for nothing."""
        LOG.info("%s by %s from %s on %s: %s", entry.action, entry.who, entry.address, entry.target, entry.outcome)
        if len(self._waiting) >= _MOST_WAITING:
            LOG.error("the store is away and %d entries wait: this one is only in this log", _MOST_WAITING)
            return
        self._waiting.append((self._clock(), entry))

    def write(self) -> None:
        """Write what waits. Raises StoreError; then it still waits."""
        with self._writing:
            batch = list(self._waiting)
            if not batch or self._database is None:
                return
            with self._database.writing() as connection:
                now_s = self._clock()
                connection.execute(_INSERT, [{"ago_s": now_s - at_s, **asdict(entry)} for at_s, entry in batch])
            for _ in batch:
                self._waiting.popleft()

    def _run(self) -> None:
        ended = False
        while not ended:
            ended = self._closing.wait(WRITE_S)
            try:
                self.write()
            except StoreError as error:
                LOG.error("%d entries are not in the audit log yet: %s", len(self._waiting), one_line(error))


def write_entry(database: Database, entry: AuditEntry) -> None:
    """Write one entry at once, for a command. Raises StoreError."""
    with database.writing() as connection:
        connection.execute(insert(audit).values(at_s=now(), **asdict(entry)))


def audit_page(database: Database, *, limit: int, before: int | None = None) -> tuple[AuditRecord, ...]:
    """The newest entries first; those with a smaller number than ``before``. Raises StoreError."""
    query = select(audit).order_by(audit.c.number.desc()).limit(limit)
    if before is not None:
        query = query.where(audit.c.number < before)
    with database.reading() as connection:
        return tuple(AuditRecord(**row._mapping) for row in connection.execute(query))
