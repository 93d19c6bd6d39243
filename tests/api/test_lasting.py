"""A collection of garbage does not stop a process for long."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from api.processes.lasting import collect_seldom, keep_what_is_there


class Node:
    """Refers to itself: only the collector frees it."""

    def __init__(self) -> None:
        self.me = self


@pytest.mark.usefixtures("thawed")
def test_a_collection_looks_at_what_was_made_later_alone_and_frees_it() -> None:
    before = len(gc.get_objects())
    keep_what_is_there()
    assert len(gc.get_objects()) < 0.01 * before
    later = weakref.ref(Node())
    gc.collect()
    assert later() is None


@pytest.mark.usefixtures("as_before")
def test_what_stays_is_not_looked_through_again_and_again_and_garbage_is_freed_all_the_same() -> None:
    gc.collect()
    collect_seldom()
    lost = weakref.ref(Node())
    before = collections()
    made = [[k] for k in range(100_000)]
    young, older, whole = (now - then for now, then in zip(collections(), before, strict=True))
    assert len(made) // 10_000 <= young < 20
    assert (older, whole) == (0, 0)
    assert lost() is None


def collections() -> list[int]:
    """How many there have been of each generation."""
    return [one["collections"] for one in gc.get_stats()]


@pytest.fixture
def as_before() -> Iterator[None]:
    usual = gc.get_threshold()
    yield
    gc.set_threshold(*usual)


@pytest.fixture
def thawed() -> Iterator[None]:
    yield
    gc.unfreeze()
