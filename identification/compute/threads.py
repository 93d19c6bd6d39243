"""Tasks on the threads of one pool: the solver releases the interpreter lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from queue import SimpleQueue
from threading import Semaphore

from identification.compute.executor import Executor, Item, Outcome, Outcomes, Tasks, Value


class Threads:
    """As many tasks at once as `workers`, however deep they are nested: the thread that asks, and idle helpers.

    Nothing is ever queued behind a task, so that a task may wait for tasks of its own: the thread that asks works
    itself, helpers join only where they are idle, and what is waited for is already running.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._idle = Semaphore(workers - 1)
        self._pool = ThreadPoolExecutor(max(workers - 1, 1), thread_name_prefix="compute")  # starts none before use

    @property
    def workers(self) -> int:
        return self._workers

    @property
    def here(self) -> Executor:
        return self

    def carry_out(self, function: Callable[[Item], Value], tasks: Tasks[Item]) -> Outcomes[Value]:
        ended: SimpleQueue[Outcome[Value] | None] = SimpleQueue()
        helpers = self._call_helpers(function, tasks, ended)
        try:
            while (own := tasks.do_next(function)) is not None:
                yield own
                while not ended.empty():
                    if (other := ended.get()) is None:
                        helpers -= 1
                    else:
                        yield other
            while helpers:
                if (other := ended.get()) is None:
                    helpers -= 1
                else:
                    yield other
        finally:
            tasks.stop()
            while helpers:
                helpers -= ended.get() is None

    def _call_helpers(
        self, function: Callable[[Item], Value], tasks: Tasks[Item], ended: SimpleQueue[Outcome[Value] | None]
    ) -> int:
        """How many idle threads now help with these tasks; each puts a None at its end."""
        count = 0
        while count < tasks.left - 1 and self._idle.acquire(blocking=False):
            self._pool.submit(copy_context().run, self._help, function, tasks, ended)
            count += 1
        return count

    def _help(
        self, function: Callable[[Item], Value], tasks: Tasks[Item], ended: SimpleQueue[Outcome[Value] | None]
    ) -> None:
        try:
            while (outcome := tasks.do_next(function)) is not None:
                ended.put(outcome)
        finally:
            self._idle.release()
            ended.put(None)

    def close(self) -> None:
        self._pool.shutdown()
