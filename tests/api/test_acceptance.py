"""Campaigns that are asked for at once are stored together, and each as if it had come alone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from sqlalchemy import event, func, select

from api.campaigns.acceptance import Acceptance, Wanted
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.records import Campaign
from api.campaigns.store import CampaignStore
from api.errors import DiskFull, InputError, StoreError
from api.settings import Settings
from api.store.database import Database
from api.store.group_commit import GroupCommit
from api.store.idempotency import GivenAnswer, IdempotencyKeys, KeyedRequest
from api.store.runs import open_runs
from api.store.tables import campaigns, events, idempotency_keys, rigs, tests

DAY_S = 86400.0


def answer(campaign: Campaign) -> GivenAnswer:
    return GivenAnswer(status=201, location=f"/v1/campaigns/{campaign.id}", answer=campaign.name)


@pytest.fixture
def wanted(body: dict[str, Any]) -> Callable[..., Wanted]:
    """A campaign that is asked for, by its name; with a key where one is given."""

    def make(name: str, *, key: str = "", rig: str = "", fingerprint: str = "") -> Wanted:
        request = KeyedRequest(key=key, address="POST /v1/campaigns", fingerprint=(fingerprint or name).ljust(64, "0"))
        new = NewCampaign(**{**body, "name": name, "rig": rig or body["rig"]})
        return Wanted(new=new, plan=new.plan, created_by="Anna", request=request if key else None, answer=answer)

    return make


@pytest.fixture
def keys(database: Database) -> IdempotencyKeys:
    return IdempotencyKeys(database, keep_s=DAY_S)


@pytest.fixture
def acceptance(database: Database, keys: IdempotencyKeys, tmp_path: Path) -> Acceptance:
    return Acceptance(database, keys, open_runs(database, Settings(data_dir=tmp_path / "data")))


@pytest.fixture
def statements(database: Database) -> list[str]:
    """A growing list of what is sent to the database."""
    sent: list[str] = []

    def note(connection: object, cursor: object, statement: str, *_: object) -> None:
        sent.append(statement)

    event.listen(database.engine, "before_cursor_execute", note)
    return sent


def at_once(database: Database, acceptance: Acceptance, wanted: Sequence[Wanted]) -> list[Any]:
    """The answers or errors of those who gather while a first transaction is under way."""
    group = GroupCommit(database)
    begun, go_on = Event(), Event()

    def first() -> None:
        begun.set()
        assert go_on.wait(60)

    async def gather() -> list[Any]:
        waiting = asyncio.gather(*(group.stored(acceptance, one) for one in wanted), return_exceptions=True)
        while group.waiting < len(wanted):
            await asyncio.sleep(0)
        go_on.set()
        return await waiting

    with ThreadPoolExecutor(1) as pool:
        leading = pool.submit(group.store, first)
        assert begun.wait(60)
        try:
            return asyncio.run(gather())
        finally:
            go_on.set()
            leading.result(60)


def count(database: Database, table: Any) -> int:
    with database.reading() as connection:
        return int(connection.scalar(select(func.count()).select_from(table)) or 0)


def test_a_group_is_stored_with_as_many_statements_whatever_its_size(
    database: Database,
    store: CampaignStore,
    acceptance: Acceptance,
    wanted: Callable[..., Wanted],
    statements: list[str],
) -> None:
    store.create(wanted("first").new)
    sent = []
    for size in (3, 12):
        statements.clear()
        given = at_once(database, acceptance, [wanted(f"{size}-{k}", key=f"{size}-{k}") for k in range(size)])
        sent.append(len(statements))
        assert [one[0].answer for one in given] == [f"{size}-{k}" for k in range(size)]
        assert not any(again for _, again in given)
    assert sent[0] == sent[1]
    assert count(database, campaigns) == 16
    assert count(database, tests) == 32
    assert count(database, events) == 16
    assert count(database, idempotency_keys) == 15


def test_what_is_stored_together_reads_back_as_it_was_answered(
    database: Database, store: CampaignStore, acceptance: Acceptance, wanted: Callable[..., Wanted]
) -> None:
    store.create(wanted("first").new)
    made: dict[str, Campaign] = {}

    def noting(campaign: Campaign) -> GivenAnswer:
        made[campaign.id] = campaign
        return answer(campaign)

    at_once(database, acceptance, [replace(wanted(f"{k}"), answer=noting) for k in range(4)])
    assert len(made) == 4
    for one in made.values():
        assert store.campaign(one.id) == one
        assert [entry.text for entry in store.events(one.id)] == ["accepted"]


def test_an_error_goes_to_whom_it_belongs_and_the_others_are_stored(
    database: Database, store: CampaignStore, acceptance: Acceptance, wanted: Callable[..., Wanted]
) -> None:
    store.create(wanted("first").new)

    def breaks(campaign: Campaign) -> GivenAnswer:
        raise ZeroDivisionError

    asked = [
        wanted("a", key="a"),
        wanted("nowhere", key="b", rig="no such rig"),
        replace(wanted("broken", key="c"), answer=breaks),
        wanted("d", rig="modbus://127.0.0.1:7777"),  # registered on the way
        wanted("e", rig="modbus://127.0.0.1:7777"),
    ]
    given = at_once(database, acceptance, asked)
    assert isinstance(given[1], InputError)
    assert isinstance(given[2], ZeroDivisionError)
    assert [given[k][0].answer for k in (0, 3, 4)] == ["a", "d", "e"]
    assert {one.name for one in store.campaigns()} == {"first", "a", "d", "e"}
    assert count(database, rigs) == 2
    assert count(database, idempotency_keys) == 1


def test_one_key_creates_once_in_a_group_and_with_another_body_not_at_all(
    database: Database, store: CampaignStore, acceptance: Acceptance, wanted: Callable[..., Wanted]
) -> None:
    store.create(wanted("first").new)
    [before] = at_once(database, acceptance, [wanted("before", key="old")])
    asked = [
        *(wanted("one", key="k"), wanted("one", key="k"), wanted("other", key="k")),
        *(wanted("before", key="old"), wanted("new", key="l"), wanted("free")),
    ]
    given = at_once(database, acceptance, asked)
    assert isinstance(given[2], InputError)
    assert given[0][0] == given[1][0]
    assert [given[k][1] for k in (0, 1, 3, 4, 5)] == [False, True, True, False, False]
    assert given[3][0] == before[0]
    assert sorted(one.name for one in store.campaigns()) == ["before", "first", "free", "new", "one"]


@pytest.mark.postgresql
def test_a_key_that_another_service_answers_meanwhile_is_not_answered_twice(
    postgresql_url: str, tmp_path: Path, wanted: Callable[..., Wanted]
) -> None:
    with Database(postgresql_url) as database, Database(postgresql_url) as elsewhere:
        keys, theirs = (IdempotencyKeys(one, keep_s=DAY_S) for one in (database, elsewhere))
        acceptance = Acceptance(database, keys, open_runs(database, Settings(data_dir=tmp_path / "data")))
        CampaignStore(database).create(wanted("first").new)
        asked = [wanted("a", key="a"), wanted("b", key="b"), wanted("c")]
        request, there = asked[1].request, GivenAnswer(status=201, location="/there", answer="theirs")
        assert request is not None

        def meanwhile(connection: object, cursor: object, statement: str, *_: object) -> None:
            if "INSERT INTO campaigns" in statement:
                theirs.once(request, lambda: there)

        event.listen(database.engine, "before_cursor_execute", meanwhile)
        given = at_once(database, acceptance, asked)
        assert [one[0].answer for one in given] == ["a", "theirs", "c"]
        assert [again for _, again in given] == [False, True, False]
        assert sorted(one.name for one in CampaignStore(database).campaigns()) == ["a", "c", "first"]


def test_where_the_commit_fails_nobody_is_told_that_a_campaign_is_stored(
    database: Database, store: CampaignStore, acceptance: Acceptance, wanted: Callable[..., Wanted]
) -> None:
    store.create(wanted("first").new)

    def lose(connection: object) -> None:
        if count_in(connection) > 1:
            raise StoreError("the disk is gone")

    def count_in(connection: Any) -> int:
        return int(connection.scalar(select(func.count()).select_from(campaigns)))

    event.listen(database.engine, "commit", lose)
    given = at_once(database, acceptance, [wanted("a"), wanted("b", key="b"), wanted("c", key="b")])
    event.remove(database.engine, "commit", lose)
    assert [type(one) for one in given] == [StoreError, StoreError, InputError]
    assert [one.name for one in store.campaigns()] == ["first"]
    assert count(database, idempotency_keys) == 0


def test_a_full_disk_accepts_none_and_repeats_what_it_said_before(
    database: Database, keys: IdempotencyKeys, tmp_path: Path, wanted: Callable[..., Wanted]
) -> None:
    roomy, full = (
        Acceptance(database, keys, open_runs(database, Settings(data_dir=tmp_path / "data", least_free_bytes=least)))
        for least in (0, 2**62)
    )
    before = at_once(database, roomy, [wanted("a", key="a"), wanted("b", key="b")])
    given = at_once(database, full, [wanted("a", key="a"), wanted("c", key="c"), wanted("d"), wanted("b", key="b")])
    assert [type(given[k]) for k in (1, 2)] == [DiskFull, DiskFull]
    assert [given[0], given[3]] == [(one[0], True) for one in before]
    assert count(database, campaigns) == 2
