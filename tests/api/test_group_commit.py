"""What many threads store at once is stored in few transactions, each thread's whole or not at all."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier, Event
from typing import Any

import pytest
from sqlalchemy import event, func, insert, select

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import CampaignStore
from api.errors import Conflict, StoreError
from api.store.database import Database
from api.store.group_commit import GroupCommit
from api.store.tables import campaigns

THREADS = 12


@pytest.fixture
def commits(database: Database) -> list[int]:
    """A growing list: one entry for each commit."""
    seen: list[int] = []
    event.listen(database.engine, "commit", lambda connection: seen.append(1))
    return seen


def at_once(group: GroupCommit, works: list[Callable[[], Any]]) -> list[Any]:
    """The results or errors of works that gather while a first one is being stored."""
    begun, go_on = Event(), Event()

    def first() -> None:
        begun.set()
        assert go_on.wait(60)

    gathered = Barrier(len(works) + 1)

    def send(work: Callable[[], Any]) -> Any:
        gathered.wait(60)
        try:
            return group.store(work)
        except Exception as error:  # noqa: BLE001 - the error is the result that is looked at
            return error

    with ThreadPoolExecutor(len(works) + 1) as pool:
        leading = pool.submit(group.store, first)
        assert begun.wait(60)
        sent = [pool.submit(send, work) for work in works]
        gathered.wait(60)
        while group.waiting < len(works):
            assert not any(one.done() for one in sent)
        go_on.set()
        leading.result(60)
        return [one.result(60) for one in sent]


def test_what_gathers_is_stored_with_one_commit(
    database: Database, store: CampaignStore, body: dict[str, Any], commits: list[int]
) -> None:
    new = NewCampaign(**body)
    store.create(new)
    commits.clear()
    made = at_once(GroupCommit(database), [lambda: store.create(new)] * THREADS)
    assert len(commits) == 2  # of the first, and of all that gathered
    assert sorted(one.number for one in made) == list(range(2, THREADS + 2))
    assert [store.campaign(one.id) for one in made] == made


def test_work_that_fails_takes_nothing_of_the_others_back(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    new = NewCampaign(**body)

    def refused() -> None:
        store.create(new)
        raise Conflict("not this one")

    def wrong() -> None:
        store.create(new)
        with database.writing() as connection:
            connection.execute(insert(campaigns).values(number=1))

    results = at_once(GroupCommit(database), [refused, lambda: store.create(new), wrong, lambda: store.create(new)])
    assert [type(one) for one in (results[0], results[2])] == [Conflict, StoreError]
    assert {one.id for one in store.campaigns()} == {results[1].id, results[3].id}


def test_where_the_commit_fails_nobody_is_told_that_something_is_stored(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    new = NewCampaign(**body)

    def lose(connection: object) -> None:
        raise Conflict("the disk is gone")

    event.listen(database.engine, "commit", lose)
    with pytest.raises(Conflict, match="gone"):
        GroupCommit(database).store(lambda: store.create(new))
    event.remove(database.engine, "commit", lose)
    with database.reading() as connection:
        assert connection.scalar(select(func.count()).select_from(campaigns)) == 0
