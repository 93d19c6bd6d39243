"""Run independent tasks on the executor of this context: their values in order, progress, cancellation, first error."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache

from identification.compute.blas import one_blas_thread
from identification.compute.executor import Executor, Failed, Item, Tasks, Value
from identification.compute.threads import Threads
from identification.compute.workers import available_workers
from identification.errors import Cancelled

_Coming = Generator[tuple[int, Value], None, None]


def _never() -> bool:
    return False


@dataclass(frozen=True, slots=True)
class _Setting:
    executor: Executor
    cancelled: Callable[[], bool]

    def check(self) -> None:
        if self.cancelled():
            raise Cancelled("the work was cancelled")


_SETTING: ContextVar[_Setting | None] = ContextVar("compute", default=None)


@contextmanager
def using(executor: Executor, cancelled: Callable[[], bool] = _never) -> Iterator[None]:
    """Let everything within run its tasks on `executor`, until `cancelled` answers True.

    `cancelled` is asked by every thread that works here, at the latest every 0.1 s while other processes work.
    """
    before = _SETTING.set(_Setting(executor, cancelled))
    try:
        yield
    finally:
        _SETTING.reset(before)


def run(
    function: Callable[[Item], Value], items: Sequence[Item], *, on_done: Callable[[int, int], None] | None = None
) -> list[Value]:
    """The function's value for each item, in their order, whichever executor works them out.

    `function` is of a module, or a `partial` of one, so that it can be sent to another process; what it is bound to is
    sent once to each. `on_done` is told, in this thread, how many of how many are done.

    Raises
    ------
    Cancelled
        when the context was cancelled; work in other processes is ended within a second, tasks of this one go on to
        their end or to the next tasks that they would run.
    WorkerLost
        when a worker process or the cluster ended.

    and what the first of the items that fail raised.
    """
    setting = _setting()
    return _in_order(_finished(setting, setting.executor, function, items), len(items), on_done)


def run_here(function: Callable[[Item], Value], items: Sequence[Item]) -> list[Value]:
    """The same for tasks of a few milliseconds, which never leave this process."""
    setting = _setting()
    return _in_order(_finished(setting, setting.executor.here, function, items), len(items), None)


def finished(function: Callable[[Item], Value], items: Sequence[Item]) -> _Coming[Value]:
    """Index and value of each item as they come, see `run`; an error is raised after what was running has ended."""
    setting = _setting()
    return _finished(setting, setting.executor, function, items)


def _in_order(come: _Coming[Value], count: int, on_done: Callable[[int, int], None] | None) -> list[Value]:
    values: dict[int, Value] = {}
    with closing(come):
        for index, value in come:
            values[index] = value
            if on_done is not None:
                on_done(len(values), count)
    return [values[index] for index in range(count)]


def _finished(
    setting: _Setting, executor: Executor, function: Callable[[Item], Value], items: Sequence[Item]
) -> _Coming[Value]:
    setting.check()
    if not items:
        return
    tasks, failed = Tasks(items), list[Failed]()
    with one_blas_thread(), closing(executor.carry_out(function, tasks)) as outcomes:
        for outcome in outcomes:
            setting.check()
            if isinstance(outcome, Failed):
                tasks.stop()
                failed.append(outcome)
            elif outcome is not None and not failed:
                yield outcome.index, outcome.value
    if failed:
        raise min(failed, key=lambda f: f.index).error


def _setting() -> _Setting:
    return _SETTING.get() or _default()


@cache
def _default() -> _Setting:
    return _Setting(Threads(available_workers()), _never)
