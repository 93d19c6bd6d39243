"""Leases: of many who ask one gets the resource, and whoever lost it can write nothing; on nobody's wall clock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import select

from api.errors import LeaseLost
from api.store.database import Database
from api.store.leases import Lease, acquire, holders, new_owner, release, renew
from api.store.tables import leases

LEASE_S = 20.0


def taken(database: Database, owner: str, resource: str = "rig 1") -> Lease | None:
    with database.writing() as connection:
        return acquire(connection, database.sightings, resource, owner, LEASE_S)


def renewed(database: Database, lease: Lease) -> None:
    with database.writing() as connection:
        renew(connection, lease)


def held_by(database: Database) -> dict[str, str]:
    with database.reading() as connection:
        return holders(connection, database.sightings)


def test_two_holders_of_one_resource_there_are_not_and_of_two_there_are(database: Database) -> None:
    assert taken(database, "one") is not None
    assert taken(database, "two") is None
    assert taken(database, "two", "job 7") is not None
    assert held_by(database) == {"rig 1": "one", "job 7": "two"}


def test_not_even_its_own_holder_gets_it_twice(database: Database) -> None:
    assert taken(database, "one") is not None
    assert taken(database, "one") is None


def test_of_many_who_ask_at_once_exactly_one_gets_it(database: Database, pass_time: Callable[[float], None]) -> None:
    for _ in range(2):  # where nobody had it, and where its holder is dead
        with ThreadPoolExecutor(8) as pool:
            got = list(pool.map(lambda k: taken(database, f"worker {k}"), range(8)))
        assert sum(lease is not None for lease in got) == 1
        pass_time(LEASE_S + 1.0)


def test_a_lease_that_ran_out_is_kept_by_a_renewal_where_nobody_took_it(
    database: Database, pass_time: Callable[[float], None]
) -> None:
    lease = taken(database, "one")
    assert lease is not None
    pass_time(LEASE_S + 1.0)
    assert held_by(database) == {}
    renewed(database, lease)
    assert held_by(database) == {"rig 1": "one"}
    assert taken(database, "two") is None


def test_of_a_dead_holder_another_takes_it_and_the_dead_one_writes_nothing_when_it_comes_back(
    database: Database, pass_time: Callable[[float], None]
) -> None:
    dead = taken(database, "one")
    assert dead is not None
    pass_time(LEASE_S + 1.0)
    assert taken(database, "two") is not None
    with pytest.raises(LeaseLost, match="rig 1: another worker holds its lease"):
        renewed(database, dead)
    with database.writing() as connection:
        release(connection, dead)
    assert held_by(database) == {"rig 1": "two"}


def test_a_holder_that_renews_keeps_it_for_ever_and_one_that_nobody_has_watched_so_long_is_not_dead(
    database: Database, database_url: str, pass_time: Callable[[float], None]
) -> None:
    lease = taken(database, "one")
    assert lease is not None
    for _ in range(5):
        pass_time(0.9 * LEASE_S)
        assert taken(database, "two") is None
        renewed(database, lease)
    pass_time(LEASE_S + 1.0)
    with Database(database_url) as started_now:
        assert taken(started_now, "two") is None
        assert held_by(started_now) == {"rig 1": "one"}
    assert held_by(database) == {}


def test_what_is_released_is_free_at_once_and_leaves_no_row(database: Database) -> None:
    lease = taken(database, "one")
    assert lease is not None
    with database.writing() as connection:
        release(connection, lease)
        assert connection.execute(select(leases)).all() == []
    assert taken(database, "two") is not None


def test_no_two_owners_have_one_name() -> None:
    assert new_owner() != new_owner()
