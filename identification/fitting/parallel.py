"""Work on two cores at once: the solver releases the interpreter lock, and what waits for it costs little."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")

_AT_ONCE = 3  # one more than there are cores: each waits now and then for the longer of its own two


def side_by_side(function: Callable[[Item], Value], items: Sequence[Item]) -> list[Value]:
    """The function's value for each item, in their order; the first exception of any of them is raised.

    For tasks of many milliseconds, which may start some of their own.
    """
    if len(items) < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        return list(pool.map(function, items))
