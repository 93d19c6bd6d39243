"""Answers that were given once: a request that is repeated with its key gets the same answer and does nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from operator import itemgetter

from sqlalchemy import ColumnElement, Connection, delete, select, update
from sqlalchemy.dialects import postgresql, sqlite

from api.errors import Conflict, InputError
from api.store.clock import now
from api.store.database import Database
from api.store.tables import idempotency_keys as keys

__all__ = ["GivenAnswer", "IdempotencyKeys", "KeyedRequest"]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyedRequest:
    """A request that creates something: its key, method and path, and SHA-256 of person, query and body."""

    key: str
    address: str
    fingerprint: str


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenAnswer:
    """The answer to a request that created something; ``answer`` is JSON."""

    status: int
    location: str
    answer: str


class IdempotencyKeys:
    """The keys of the last ``keep_s`` seconds, on the clock of the database; shared by all services of one store."""

    def __init__(self, database: Database, *, keep_s: float) -> None:
        self._database, self._keep_s = database, keep_s

    def given(self, request: KeyedRequest) -> GivenAnswer | None:
        """The answer that was given to this request; None to a new one. Raises InputError as ``once`` does."""
        with self._database.reading() as connection:
            return self._given(connection, request)

    def once(self, request: KeyedRequest, create: Callable[[], GivenAnswer]) -> tuple[GivenAnswer, bool]:
        """The answer of ``create``, called once for a key, and whether it was given before.

        What ``create`` writes and the key are stored in one transaction. Of two requests at once, on any service of
        the store, the second waits for the first. Raises InputError where the key came with another query or body.
        """
        with self._database.together() as connection:
            connection.execute(delete(keys).where(self._expired))
            blank = GivenAnswer(status=0, location="", answer="")
            if not _insert(connection, [(request, blank)]):
                before = self._given(connection, request)
                assert before is not None  # the row that was in the way
                return before, True
            made = create()
            connection.execute(update(keys).where(_is(request)).values(**asdict(made)))
            return made, False

    def came_before(self, requests: Sequence[KeyedRequest]) -> frozenset[tuple[str, str]]:
        """The keys and addresses of those requests that came before, with whichever body."""
        with self._database.writing() as connection:
            connection.execute(delete(keys).where(self._expired))
            query = select(keys.c.key, keys.c.address).where(keys.c.key.in_({one.key for one in requests}))
            return frozenset((row.key, row.address) for row in connection.execute(query))

    def keep(self, given: Sequence[tuple[KeyedRequest, GivenAnswer]]) -> None:
        """Keep the answers to requests with different keys. Raises Conflict where one of them has come meanwhile."""
        with self._database.writing() as connection:
            if _insert(connection, given) < len(given):
                raise Conflict("a request with the same Idempotency-Key is being answered: try again")

    @property
    def _expired(self) -> ColumnElement[bool]:
        return keys.c.created_at_s <= now() - self._keep_s

    def _given(self, connection: Connection, request: KeyedRequest) -> GivenAnswer | None:
        row = connection.execute(select(keys).where(_is(request), ~self._expired)).one_or_none()
        if row is None:
            return None
        if row.fingerprint != request.fingerprint:
            raise InputError(
                f"Idempotency-Key {request.key!r:.60} came with another body or query, or from somebody else, before: "
                "give every request a key of its own"
            )
        return GivenAnswer(status=row.status, location=row.location, answer=row.answer)


def _insert(connection: Connection, given: Sequence[tuple[KeyedRequest, GivenAnswer]]) -> int:
    """Insert answers in the order of their keys, so that two services never wait for each other; returns how many.

    A request whose key is there already is left out; where another service is storing it, that is waited for.
    """
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    rows = sorted(
        ({**asdict(request), **asdict(answer)} for request, answer in given), key=itemgetter("key", "address")
    )
    added = insert(keys).values(created_at_s=now()).on_conflict_do_nothing().returning(keys.c.key)
    return len(connection.execute(added, rows).all())


def _is(request: KeyedRequest) -> ColumnElement[bool]:
    return (keys.c.key == request.key) & (keys.c.address == request.address)
