"""What an executor is: it begins tasks in their order and tells what each came to as soon as it ends."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Generic, Protocol, TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")
Value_co = TypeVar("Value_co", covariant=True)


@dataclass(frozen=True, slots=True)
class Finished(Generic[Value_co]):
    """A task that gave a value."""

    index: int
    value: Value_co


@dataclass(frozen=True, slots=True)
class Failed:
    """A task that raised."""

    index: int
    error: BaseException


Outcome = Finished[Value] | Failed
Outcomes = Generator[Outcome[Value] | None, None, None]  # None: nothing new, so that the caller can ask for a stop


class Tasks(Generic[Item]):
    """The items that are still to be taken, in their order, by any number of threads; none after a failure."""

    def __init__(self, items: Sequence[Item]) -> None:
        self._items, self._next, self._lock = items, 0, Lock()

    @property
    def left(self) -> int:
        """How many have not been taken."""
        return len(self._items) - self._next

    def take(self) -> tuple[int, Item] | None:
        """The next item with its index; None where there is no more to begin."""
        with self._lock:
            index = self._next
            if index >= len(self._items):
                return None
            self._next += 1
        return index, self._items[index]

    def stop(self) -> None:
        """Let nothing more be taken."""
        with self._lock:
            self._next = len(self._items)

    def do_next(self, function: Callable[[Item], Value]) -> Outcome[Value] | None:
        """What the next item came to in this thread; None where there is no more to begin."""
        if (task := self.take()) is None:
            return None
        index, item = task
        try:
            return Finished(index, function(item))
        except Exception as error:  # noqa: BLE001 - whatever it is, `finished` raises it again
            self.stop()
            return Failed(index, error)


class Executor(Protocol):
    """Runs tasks. Closed by whoever made it; it may serve many calls, also calls from within its own tasks."""

    @property
    def workers(self) -> int:
        """How many tasks run at once."""

    @property
    def here(self) -> Executor:
        """What runs tasks of this process that are too short to send away."""

    def carry_out(self, function: Callable[[Item], Value], tasks: Tasks[Item]) -> Outcomes[Value]:
        """What the tasks came to, in the order in which they end.

        No task begins before those ahead of it have begun, and none after a failure. Closing the generator ends the
        work that runs elsewhere, and waits for what runs in this process.
        """

    def close(self) -> None:
        """End every thread, process and connection; safe to call twice."""
