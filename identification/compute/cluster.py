"""Tasks on a Dask cluster, by the address of its scheduler."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from concurrent.futures import CancelledError
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from identification.compute.blas import one_blas_thread
from identification.compute.executor import Executor, Failed, Item, Outcomes, Tasks, Value
from identification.compute.futures import ASK_S, Future, outcomes_of
from identification.compute.running import using
from identification.compute.serial import Serial
from identification.compute.threads import Threads
from identification.errors import ComputeError, WorkerLost

if TYPE_CHECKING:
    from distributed import Client

DEADLINE_S = 10.0  # for the scheduler to answer, and for a first worker to be there
_AHEAD = 2  # tasks sent for each thread of the cluster: none waits for its next


class Cluster:
    """As many tasks at once as the workers of the scheduler at `address` have threads.

    Every worker needs this package in the same version. A task whose worker is lost is done again by another one.

    Raises
    ------
    ComputeError
        when the extra `dask` is missing, nobody answers at the address, or the scheduler has no worker.
    """

    def __init__(self, address: str, *, threads: int, deadline_s: float = DEADLINE_S) -> None:
        self._address = address
        self._client = _connected(address, deadline_s)
        self._here = Threads(threads)

    @property
    def workers(self) -> int:
        threads: dict[str, int] = self._client.nthreads()
        return max(sum(threads.values()), 1)

    @property
    def here(self) -> Executor:
        return self._here

    def carry_out(self, function: Callable[[Item], Value], tasks: Tasks[Item]) -> Outcomes[Value]:
        sent: set[Any] = set()  # Any: futures of distributed, which has few types
        try:
            yield from self._watched(self._outcomes(function, tasks, sent))
        except (CancelledError, OSError) as error:  # of the connection: what a task raises comes as an outcome
            raise self._lost() from error
        finally:
            self._client.cancel([*sent], force=True)

    def _outcomes(self, function: Callable[[Item], Value], tasks: Tasks[Item], sent: set[Any]) -> Outcomes[Value]:
        """What the tasks came to; in `sent` are the futures that are not done."""
        # A task, not scattered data: what a lost worker held is then made again.
        shared = self._submit(bytes, pickle.dumps(function))
        sent.add(shared)

        def submit(item: Item, on_end: Callable[[Future[Value]], None]) -> None:
            future = self._submit(_in_worker, shared, pickle.dumps(item))
            sent.add(future)
            future.add_done_callback(on_end)
            future.add_done_callback(sent.discard)

        yield from outcomes_of(submit, tasks, _AHEAD * self.workers)

    def _submit(self, function: Callable[..., Any], *arguments: Any) -> Any:  # Any: see `carry_out`
        from dask import config

        with config.set({"distributed.admin.large-graph-warning-threshold": sys.maxsize}):  # large, but sent only once
            return self._client.submit(function, *arguments, pure=False)

    def _watched(self, outcomes: Outcomes[Value]) -> Outcomes[Value]:
        """The outcomes, until a task has cost several workers, or nothing ends and no worker is left."""
        from distributed.scheduler import KilledWorker

        idle = 0
        for outcome in outcomes:
            if isinstance(outcome, Failed) and isinstance(outcome.error, KilledWorker):
                raise self._lost() from outcome.error
            idle = idle + 1 if outcome is None else 0
            if idle * ASK_S > DEADLINE_S and not self._client.nthreads():
                raise self._lost()
            yield outcome

    def _lost(self) -> WorkerLost:
        return WorkerLost(f"the Dask cluster at '{self._address}' was lost with tasks on it")

    def close(self) -> None:
        self._client.close()
        self._here.close()


def _connected(address: str, deadline_s: float) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise ComputeError(f"'{address}' needs the extra: pip install 'damper-rig[dask]'") from error
    try:
        client = Client(address, timeout=deadline_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ComputeError(
            f"no Dask scheduler answers at '{address}' within {deadline_s:g} s: start one there, or unset "
            "DAMPER_RIG_EXECUTOR"
        ) from error
    try:
        client.wait_for_workers(1, timeout=deadline_s)
    except TimeoutError as error:
        client.close()
        raise ComputeError(f"the Dask scheduler at '{address}' has no worker after {deadline_s:g} s") from error
    return client


@lru_cache(maxsize=2)
def _loaded(function: bytes) -> Callable[[Any], Any]:  # Any: what was pickled
    loaded: Callable[[Any], Any] = pickle.loads(function)
    return loaded


def _in_worker(function: bytes, item: bytes) -> Any:  # Any: the value of the item
    task, value = _loaded(function), pickle.loads(item)  # first, so that the libraries that they import are limited too
    with one_blas_thread(), using(Serial()):
        return task(value)
