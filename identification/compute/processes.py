"""Tasks on processes of this machine, which end with the one that started them."""

from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import NamedTemporaryFile
from threading import Lock, Thread
from typing import Any

from identification.compute.blas import one_blas_thread
from identification.compute.executor import Executor, Failed, Item, Outcomes, Tasks, Value
from identification.compute.futures import Future, outcomes_of
from identification.compute.running import using
from identification.compute.serial import Serial
from identification.compute.threads import Threads
from identification.errors import WorkerLost


class Processes:
    """As many processes as `workers`, started when first needed; each runs the tasks of a task on `threads_each`.

    A cancelled call ends them all, whoever else uses them; the next call starts new ones.
    """

    def __init__(self, workers: int, *, threads_each: int = 1) -> None:
        self._workers, self._threads_each = workers, threads_each
        self._here = Threads(workers)
        self._lock = Lock()
        self._pool: tuple[ProcessPoolExecutor, Connection] | None = None

    @property
    def workers(self) -> int:
        return self._workers

    @property
    def here(self) -> Executor:
        return self._here

    def carry_out(self, function: Callable[[Item], Value], tasks: Tasks[Item]) -> Outcomes[Value]:
        pool, path = self._started(), _written(function)

        def submit(item: Item, on_end: Callable[[Future[Value]], None]) -> None:
            pool.submit(_in_worker, path, item).add_done_callback(on_end)

        ended = False
        try:
            # one more than there are workers: none waits for its next task
            for outcome in outcomes_of(submit, tasks, self._workers + 1):
                if isinstance(outcome, Failed) and isinstance(outcome.error, BrokenProcessPool):
                    raise WorkerLost(
                        "a worker process ended before its task: was it killed, or is there too little memory for "
                        f"{self._workers} of them (DAMPER_RIG_WORKERS)?"
                    ) from outcome.error
                yield outcome
            ended = True
        except BrokenProcessPool as error:  # on submission
            raise WorkerLost("a worker process ended before its task") from error
        finally:
            if not ended:
                self._end()
            path.unlink()

    def _started(self) -> ProcessPoolExecutor:
        with self._lock:
            if self._pool is None:
                alive, parent = Pipe(duplex=False)
                self._pool = (
                    ProcessPoolExecutor(
                        self._workers,
                        mp_context=get_context("spawn"),
                        initializer=_begin,
                        initargs=(alive, self._threads_each),
                    ),
                    parent,
                )
            return self._pool[0]

    def _end(self) -> None:
        with self._lock:
            if self._pool is not None:
                pool, parent = self._pool
                self._pool = None
                parent.close()
                pool.shutdown(cancel_futures=True)

    def close(self) -> None:
        self._end()
        self._here.close()


def _written(function: Callable[..., object]) -> Path:
    """A file with the function and what it is bound to, which each process reads once."""
    with NamedTemporaryFile(prefix="damper-rig-task-", delete=False) as file:
        file.write(pickle.dumps(function))
    return Path(file.name)


@lru_cache(maxsize=2)
def _read(path: Path) -> Callable[[Any], Any]:  # Any: what `_written` was given
    loaded: Callable[[Any], Any] = pickle.loads(path.read_bytes())
    return loaded


_INNER: list[Executor] = [Serial()]  # of this worker process: what its tasks run tasks of their own on


def _begin(alive: Connection, threads: int) -> None:
    """Prepare a worker: it ends with its parent, or when that closes its end of the pipe."""
    for name in ("SIGINT", "SIGHUP", "SIGQUIT"):  # from a terminal they reach the parent too, which ends this one
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)

    def watch() -> None:
        alive.poll(None)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
    if threads > 1:
        _INNER[0] = Threads(threads)


def _in_worker(path: Path, item: Any) -> Any:  # Any: an item and its value
    function = _read(path)  # first, so that the libraries that it imports are limited too
    with one_blas_thread(), using(_INNER[0]):
        return function(item)
