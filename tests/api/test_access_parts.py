"""Times, rates and places, on clocks that the tests set."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from api.access.connections import Connections
from api.access.gate import Gate
from api.access.identity import Identity, Refused
from api.access.keyring import Keyring
from api.access.keys import KeyStore
from api.access.rates import Buckets
from api.access.rules import Rule
from api.access.scopes import Scope
from api.access.snapshot import ABSOLUTE_S, IDLE_S
from api.errors import StoreError
from api.store.database import Database


class Clock:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


def one_key(database: Database, days: float | None = None) -> str:
    return KeyStore(database).create("Anna", Scope.OPERATE, expires_days=days, created_by="test")[1]


def open_keyring(database: Database, clock: Clock) -> Keyring:
    keyring = Keyring(clock)
    keyring._database = database  # without the thread that reads again
    keyring.refresh()
    return keyring


def test_a_key_expires_on_time_also_while_the_store_is_away(database: Database, clock: Clock) -> None:
    key = one_key(database, days=1.0)
    keyring = open_keyring(database, clock)
    clock.now_s += 86400.0 - 30.0
    assert isinstance(keyring.of_key(key), Identity)
    clock.now_s += 60.0
    found = keyring.of_key(key)
    assert isinstance(found, Refused)
    assert "expired" in found.detail


def test_a_session_ends_when_it_idles_and_at_the_end_of_a_shift(database: Database, clock: Clock) -> None:
    keyring = open_keyring(database, clock)
    keyring_key = one_key(database)
    keyring.refresh()
    identity = keyring.of_key(keyring_key)
    assert isinstance(identity, Identity)
    used, idle = keyring.sign_in(identity), keyring.sign_in(identity)
    step_s = IDLE_S * 0.9
    for _ in range(int(ABSOLUTE_S / step_s)):
        clock.now_s += step_s
        assert isinstance(keyring.of_session(used), Identity)
    assert isinstance(keyring.of_session(idle), Refused)
    clock.now_s += step_s
    assert isinstance(keyring.of_session(used), Refused)


def test_the_store_learns_that_a_key_is_used_at_most_once_a_minute(database: Database, clock: Clock) -> None:
    key = one_key(database)
    keyring, store = open_keyring(database, clock), KeyStore(database)
    keyring.refresh()
    assert store.every()[0].used_at_s is None
    keyring.of_key(key)
    keyring.refresh()
    first = store.every()[0].used_at_s
    assert first is not None
    clock.now_s += 30.0
    keyring.of_key(key)
    keyring.refresh()
    assert store.every()[0].used_at_s == first
    clock.now_s += 40.0
    keyring.of_key(key)
    keyring.refresh()
    assert (store.every()[0].used_at_s or 0.0) > first


def test_what_was_read_holds_while_the_store_is_away_and_stopping_asks_no_store(tmp_path: Path, clock: Clock) -> None:
    file = tmp_path / "x.db"
    with Database(f"sqlite:///{file}") as database:
        key = one_key(database)
        keyring = open_keyring(database, clock)
        gate = Gate(keyring, keys_required=False)
        database.close()
        for beside in tmp_path.iterdir():
            beside.unlink()
        tmp_path.rmdir()
        with pytest.raises(StoreError):
            keyring.refresh()
        scope = {"type": "http", "method": "POST", "headers": [(b"authorization", f"Bearer {key}".encode())]}
        found = gate.may_stop(scope)
        assert isinstance(found, Identity)
        assert found.name == "Anna"
        assert gate.may_stop({**scope, "headers": []}) is False
        assert gate.may_stop({**scope, "headers": [*scope["headers"], (b"origin", b"http://evil.example")]}) is False


def test_nothing_passes_before_the_keys_are_read() -> None:
    gate = Gate(Keyring(), keys_required=False)
    found = gate.may({"headers": []}, Rule(scope=Scope.READ))
    assert isinstance(found, Refused)
    assert found.status == 503


def test_a_digest_that_is_copied_to_another_key_opens_nothing(database: Database, clock: Clock) -> None:
    from sqlalchemy import select, update

    from api.store.tables import keys

    low, high = one_key(database), one_key(database)
    with database.writing() as connection:
        digest = connection.scalar(select(keys.c.digest).where(keys.c.id == low.split("_")[1]))
        connection.execute(update(keys).where(keys.c.id == high.split("_")[1]).values(digest=digest))
    keyring = open_keyring(database, clock)
    secret = low.split("_", 2)[2]
    assert isinstance(keyring.of_key(low), Identity)
    assert isinstance(keyring.of_key(f"dr_{high.split('_')[1]}_{secret}"), Refused)


def test_a_bucket_gives_its_burst_then_its_rate(clock: Clock) -> None:
    buckets = Buckets(per_s=2.0, burst=3.0, clock=clock)
    assert [buckets.wait_s("a") for _ in range(4)] == [0.0, 0.0, 0.0, 0.5]
    assert buckets.wait_s("b") == 0.0
    clock.now_s += 0.5
    assert [buckets.wait_s("a"), buckets.wait_s("a")] == [0.0, 0.5]


def test_a_bucket_forgets_those_who_have_all_their_tokens_back(clock: Clock) -> None:
    buckets = Buckets(per_s=1.0, burst=5.0, clock=clock)
    for k in range(10_001):
        buckets.wait_s(str(k))
        clock.now_s += 0.001
    assert len(buckets._left) < 6000


@pytest.fixture
def sockets() -> Iterator[list[socket.socket]]:
    with ExitStack() as stack:
        yield [stack.enter_context(socket.socket()) for _ in range(12)]


def places(clock: Clock, **more: int) -> Connections:
    return Connections(**{"most": 3, "most_per_address": 2, **more}, header_s=10.0, clock=clock)


def test_the_longest_idle_connection_goes_first_those_who_were_let_through_last(
    clock: Clock, sockets: list[socket.socket]
) -> None:
    open_ = places(clock, most_per_address=9)
    for k in range(3):
        assert open_.admit(("10.0.0.1", k), sockets[k])
        clock.now_s += 1.0
    open_.is_known(("10.0.0.1", 0))
    open_.begins(("10.0.0.1", 1))
    assert open_.admit(("10.0.0.2", 3), sockets[3])  # in the place of 2
    assert set(open_._open) == {("10.0.0.1", 0), ("10.0.0.1", 1), ("10.0.0.2", 3)}
    assert open_.admit(("10.0.0.2", 4), sockets[4])  # of 3: nobody knows it
    assert open_.admit(("10.0.0.2", 5), sockets[5])
    assert ("10.0.0.1", 0) in open_._open
    open_.begins(("10.0.0.1", 0))
    open_.begins(("10.0.0.2", 5))
    assert not open_.admit(("10.0.0.3", 6), sockets[6])  # all are busy
    open_.ends(("10.0.0.2", 5))
    assert open_.admit(("10.0.0.3", 6), sockets[6])


def test_one_address_has_places_of_its_own_only_and_loopback_has_all(
    clock: Clock, sockets: list[socket.socket]
) -> None:
    open_ = places(clock, most=9)
    for k in range(3):
        assert open_.admit(("10.0.0.1", k), sockets[k])
    assert open_.by_address() == {"10.0.0.1": 2}
    for k in range(3, 8):
        assert open_.admit(("127.0.0.1", k), sockets[k])
    assert open_.by_address()["127.0.0.1"] == 5
    for k in (1, 2):
        open_.begins(("10.0.0.1", k))
    assert not open_.admit(("10.0.0.1", 9), sockets[9])
