"""One commit for all who write at once: a disk syncs a few hundred times a second, however little is written."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from threading import Lock
from typing import Any, Protocol, TypeVar

from sqlalchemy import Connection

from api.store.database import Database

__all__ = ["Batch", "GroupCommit"]

Result = TypeVar("Result")
Item = TypeVar("Item", contravariant=True)
Stored = TypeVar("Stored", covariant=True)


class Batch(Protocol[Item, Stored]):
    """How items of one kind are stored: several with few statements, or one by itself. Both raise what they like."""

    def together(self, items: Sequence[Item]) -> Sequence[Stored | None]:
        """What came of each; None: nothing was done for this one, it has to be stored by itself."""
        ...

    def alone(self, item: Item) -> Stored: ...


class _Work:
    """What one caller wants stored, and what came of it. Any: a result of the kind that its caller expects."""

    def __init__(self, do: Callable[[], Any], batch: Batch[Any, Any] | None = None, item: Any = None) -> None:
        self._do = do
        self.batch, self.item = batch, item
        self.result: Any = None
        self.done: Future[Any] | asyncio.Future[Any]
        self._error: BaseException | None = None

    def run(self, connection: Connection, *, alone: bool) -> None:
        """Do it; where it fails among others, only what it wrote itself is taken back."""
        try:
            if alone:
                self.result = self._do()
                return
            with connection.begin_nested():
                self.result = self._do()
        except BaseException as error:
            self._error = error
            if alone:
                raise

    def end(self, error: BaseException | None) -> None:
        """The transaction has ended, with an error where nothing of it was stored."""
        self._error = self._error or error

    def tell(self) -> None:
        """Tell the caller, in its own thread or loop."""
        if self.done.cancelled():  # nobody waits any more; what was asked for is stored all the same
            return
        if self._error is not None:
            self.done.set_exception(self._error)
        else:
            self.done.set_result(self.result)


class GroupCommit:
    """Stores what several callers want stored at once in one transaction.

    One thread does the work of all that wait, while later ones gather for the next transaction.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._gathering = Lock()
        self._waiting: list[_Work] = []
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="commits")

    @property
    def waiting(self) -> int:
        """How many wait for the next transaction."""
        return len(self._waiting)

    def store(self, do: Callable[[], Result]) -> Result:
        """The result of ``do``, which is stored durably when this returns. It runs in another thread.

        What ``do`` writes to the database is stored whole or not at all. Its own errors are raised, and StoreError
        where the transaction fails.
        """
        work, done = _Work(do), Future[Result]()
        work.done = done
        self._gather(work)
        return done.result()

    async def stored(self, batch: Batch[Item, Result], item: Item) -> Result:
        """What ``batch`` makes of the item, together with the others that gather; it is stored durably then.

        As with `store`, an item is stored whole or not at all, and every caller gets its own errors.
        """
        work = _Work(lambda: batch.alone(item), batch, item)
        done: asyncio.Future[Result] = asyncio.get_running_loop().create_future()
        work.done = done
        self._gather(work)
        return await done

    def _gather(self, work: _Work) -> None:
        with self._gathering:
            first = not self._waiting
            self._waiting.append(work)
        if first:
            self._thread.submit(self._lead)

    def _lead(self) -> None:
        """Store what has gathered, and tell everybody."""
        with self._gathering:
            group, self._waiting = self._waiting, []
        failure: BaseException | None = None
        try:
            with self._database.together() as connection:
                _run(connection, group)
        except BaseException as error:  # noqa: BLE001 - those who wait must hear it, whatever it was
            failure = error
        for work in group:
            work.end(failure)
        _tell(group)


def _run(connection: Connection, group: Sequence[_Work]) -> None:
    if len(group) == 1:
        group[0].run(connection, alone=True)
        return
    by_batch: dict[int, list[_Work]] = {}
    for work in group:
        by_batch.setdefault(id(work.batch), []).append(work)
    for works in by_batch.values():
        for work in _left_by_batch(connection, works):
            work.run(connection, alone=False)


def _left_by_batch(connection: Connection, works: Sequence[_Work]) -> Sequence[_Work]:
    """Store works of one kind together; returns those that have to be stored one by one."""
    batch = works[0].batch
    if batch is None or len(works) == 1:
        return works
    try:
        with connection.begin_nested():
            results = batch.together([work.item for work in works])
    except Exception:  # noqa: BLE001 - whatever it was: one by one, only who causes it gets it
        return works
    for work, result in zip(works, results, strict=True):
        work.result = result
    return [work for work in works if work.result is None]


def _tell(group: Sequence[_Work]) -> None:
    """Tell every thread, and every loop with one call."""
    by_loop: dict[asyncio.AbstractEventLoop, list[_Work]] = {}
    for work in group:
        if isinstance(work.done, asyncio.Future):
            by_loop.setdefault(work.done.get_loop(), []).append(work)
        else:
            work.tell()
    for loop, works in by_loop.items():
        with suppress(RuntimeError):  # the loop was closed: nobody waits there
            loop.call_soon_threadsafe(_tell_all, works)


def _tell_all(works: Sequence[_Work]) -> None:
    for work in works:
        work.tell()
