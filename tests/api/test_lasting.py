"""A collection of garbage does not stop a process for long."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from api.processes.lasting import keep_what_is_there


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


@pytest.fixture
def thawed() -> Iterator[None]:
    yield
    gc.unfreeze()
