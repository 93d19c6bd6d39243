"""Tasks that another process works out: a few at once, each told as soon as its future is done."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Protocol

from identification.compute.executor import Failed, Finished, Item, Outcomes, Tasks, Value, Value_co

ASK_S = 0.1  # while nothing ends: how long until the caller is asked whether to go on


class Future(Protocol[Value_co]):
    """What concurrent.futures and distributed have in common."""

    def result(self) -> Value_co: ...
    def exception(self) -> BaseException | None: ...


Submit = Callable[[Item, Callable[[Future[Value]], None]], None]


def outcomes_of(submit: Submit[Item, Value], tasks: Tasks[Item], at_once: int) -> Outcomes[Value]:
    """What the tasks came to; `submit` sends one item off and calls back once, from any thread, when it is done."""
    ended: SimpleQueue[tuple[int, Future[Value]]] = SimpleQueue()
    sent = 0
    while True:
        while sent < at_once and (task := tasks.take()) is not None:
            submit(task[1], partial(_put, ended, task[0]))
            sent += 1
        if not sent:
            return
        try:
            index, future = ended.get(timeout=ASK_S)
        except Empty:
            yield None
            continue
        sent -= 1
        error = future.exception()
        if error is not None:
            tasks.stop()
        yield Finished(index, future.result()) if error is None else Failed(index, error)


def _put(ended: SimpleQueue[tuple[int, Future[Value]]], index: int, future: Future[Value]) -> None:
    ended.put((index, future))
