"""Tasks one after the other in the thread that asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from identification.compute.executor import Executor, Item, Outcomes, Tasks, Value


@dataclass(frozen=True, slots=True)
class Serial:
    """One task at a time, in this thread."""

    workers: ClassVar[int] = 1

    @property
    def here(self) -> Executor:
        return self

    def carry_out(self, function: Callable[[Item], Value], tasks: Tasks[Item]) -> Outcomes[Value]:
        while (outcome := tasks.do_next(function)) is not None:
            yield outcome

    def close(self) -> None:
        pass
