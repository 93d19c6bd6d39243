"""The store's database: its engine, its transactions with deadlines, its schema."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from threading import local
from types import TracebackType
from typing import Self

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError
from sqlalchemy.pool import ConnectionPoolEntry

from api.errors import NewerStore, SettingsError, StoreError, one_line
from api.store.sightings import Sightings

__all__ = ["Database"]

WAIT_S = 5.0  # for a lock or a connection; then the call fails with StoreError
_MIGRATION_LOCK = 0x64616D70  # any number that only this program uses


class Database:
    """One SQLite file or PostgreSQL database with the schema of this program. Safe to use from many threads.

    Every use raises StoreError where the database does not answer by its deadline.
    """

    def __init__(self, url: str, *, migrates: bool = True, clock: Callable[[], float] = time.monotonic) -> None:
        """Open it and bring its schema to this program's version; ``migrates=False``: leave the schema as it is.

        ``clock``: the steady clock by which leases of dead holders are told.

        Raises
        ------
        SettingsError
            When the URL cannot be used.
        StoreError
            When it cannot be opened.
        NewerStore
            When a later version of this program made its schema; nothing is changed then.
        """
        self.engine = _engine(url)
        self._closed = False
        event.listen(self.engine, "checkin", self._given_back)
        self.sightings = Sightings(clock)
        self._joined = local()  # .connection: of the transaction that this thread is in, by `together`
        if not migrates:
            return
        try:
            with self.writing() as connection:
                self.migrate(connection)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close what is idle; a connection that another thread still uses is closed when that gives it back."""
        self._closed = True
        self.engine.dispose()

    def _given_back(self, _: object, record: ConnectionPoolEntry) -> None:
        if self._closed:  # its pool is gone: it would stay open until it is collected
            record.close()

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection for one consistent read of the store."""
        if joined := self._transaction():
            with self._translated():
                yield joined
            return
        with self._translated(), self.engine.connect().execution_options(reads=True) as connection, connection.begin():
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A connection in one transaction: all of it is stored, or nothing."""
        if joined := self._transaction():
            with self._translated():
                yield joined
            return
        with self._translated(), self.engine.begin() as connection:
            yield connection

    @contextmanager
    def together(self) -> Iterator[Connection]:
        """One transaction for everything that this thread reads and writes in the block: all of it, or nothing."""
        with self.writing() as connection:
            before, self._joined.connection = self._transaction(), connection
            try:
                yield connection
            finally:
                self._joined.connection = before

    def _transaction(self) -> Connection | None:
        joined: Connection | None = getattr(self._joined, "connection", None)
        return joined

    @contextmanager
    def snapshot(self) -> Iterator[Connection]:
        """A connection on which every read sees the store at one moment, however long it takes; writers go on."""
        options = {} if self.engine.dialect.name == "sqlite" else {"isolation_level": "REPEATABLE READ"}
        with self._translated(), self.engine.connect() as plain:
            connection = plain.execution_options(reads=True, **options)
            with connection.begin():
                yield connection

    def migrate(self, connection: Connection, revision: str = "head") -> None:
        """Bring the schema forward to a revision in the transaction of ``connection``; raises NewerStore."""
        config = Config()
        config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
        try:
            if connection.dialect.name == "postgresql":  # one service at a time; SQLite's writers wait anyway
                connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _MIGRATION_LOCK})
            config.attributes["connection"] = connection
            command.upgrade(config, revision)
        except CommandError as error:
            raise NewerStore(
                f"campaign store {self.place}: made by a later version of damper-rig ({one_line(error)}): "
                "use that version"
            ) from error

    def ping(self) -> None:
        """Raises StoreError where the database does not answer."""
        with self.reading() as connection:
            connection.execute(text("SELECT version_num FROM alembic_version"))

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """Translate errors of SQLAlchemy into StoreError; the only place that does."""
        try:
            yield
        except SQLAlchemyError as error:
            cause = error.orig if isinstance(error, DBAPIError) and error.orig is not None else error
            raise StoreError(f"campaign store {self.place}: {one_line(cause)}") from error

    @property
    def place(self) -> str:
        """Its address without a password, for messages."""
        return self.engine.url.render_as_string(hide_password=True)


def _engine(url: str) -> Engine:
    """The engine of an SQLite file (write-ahead log) or of a PostgreSQL database; nothing is read yet."""
    try:
        parts = make_url(url)
        if parts.get_backend_name() == "sqlite":
            return _sqlite(url, parts.database)
        deadlines = f"-c statement_timeout={WAIT_S * 2000:.0f} -c lock_timeout={WAIT_S * 1000:.0f}"
        return create_engine(
            url,
            pool_pre_ping=True,
            pool_timeout=WAIT_S,
            connect_args={"connect_timeout": int(WAIT_S), "options": deadlines},
        )
    except (ArgumentError, ImportError) as error:
        raise SettingsError(
            f"database_url cannot be used: {one_line(error)}; give sqlite:///FILE, or "
            "postgresql+psycopg://USER@HOST:PORT/NAME with damper-rig[postgresql] installed"
        ) from error


def _sqlite(url: str, database: str | None) -> Engine:
    if not database or database == ":memory:":
        raise SettingsError(f"database_url is {url!r}: campaigns need a file: sqlite:///FILE")
    try:
        Path(database).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or error
        raise SettingsError(f"{Path(database).parent}: cannot be made ({reason}): give another folder") from error
    engine = create_engine(url, connect_args={"timeout": WAIT_S})
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: SqliteConnection, record: ConnectionPoolEntry) -> None:
    connection.isolation_level = None  # transactions begin where _begin_sqlite says, not at the first write
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}")


def _begin_sqlite(connection: Connection) -> None:
    # A reader that becomes a writer fails if another wrote meanwhile: a writer therefore begins as one and waits
    reads = connection.get_execution_options().get("reads", False)
    connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")
