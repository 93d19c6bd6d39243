"""The store's database: its engine, its transactions with deadlines, its schema."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from sqlite3 import Connection as SqliteConnection
from types import TracebackType
from typing import Self

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError
from sqlalchemy.pool import ConnectionPoolEntry

from api.errors import NewerStore, SettingsError, StoreError, one_line

__all__ = ["Database"]

WAIT_S = 5.0  # for a lock or a connection; then the call fails with StoreError
_MIGRATION_LOCK = 0x64616D70  # any number that only this program uses


class Database:
    """One SQLite file or PostgreSQL database with the schema of this program. Safe to use from many threads.

    Every use raises StoreError where the database does not answer by its deadline.
    """

    def __init__(self, url: str) -> None:
        """Open it and bring its schema to this program's version.

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
        try:
            self._migrate()
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
        self.engine.dispose()

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection for one consistent read of the store."""
        with self._translated(), self.engine.connect().execution_options(reads=True) as connection, connection.begin():
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A connection in one transaction: all of it is stored, or nothing."""
        with self._translated(), self.engine.begin() as connection:
            yield connection

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
            raise StoreError(f"campaign store {self._place}: {one_line(cause)}") from error

    def _migrate(self) -> None:
        config = Config()
        config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
        try:
            with self.writing() as connection:
                if connection.dialect.name == "postgresql":  # one service at a time; SQLite's writers wait anyway
                    connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _MIGRATION_LOCK})
                config.attributes["connection"] = connection
                command.upgrade(config, "head")
        except CommandError as error:
            raise NewerStore(
                f"campaign store {self._place}: made by a later version of damper-rig ({one_line(error)}): "
                "use that version"
            ) from error

    @property
    def _place(self) -> str:
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
        raise StoreError(f"{Path(database).parent}: cannot be made: {one_line(error)}") from error
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
