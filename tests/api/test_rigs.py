"""Rigs are things of the store: one rig has one record, one lease and one queue, however it is spelt."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from api.campaigns.held_rig import hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.rig_store import RigStore
from api.campaigns.rigs import check_allowed
from api.campaigns.store import CampaignStore
from api.errors import Changed, Conflict, InputError, NotFound
from api.settings import Settings
from api.store.database import Database
from rigctl.limits import Limits
from rigctl.transport import Capability, Identity

HERE, THERE = "modbus://127.0.0.1:5020", "modbus://127.0.0.1:5021"
SPELLINGS = (HERE, "modbus://localhost:5020", "MODBUS://LOCALHOST:5020", "modbus://[::1]:5020")


@pytest.fixture
def identity() -> Identity:
    """A machine of a laboratory, which is not simulated."""
    limits = Limits(
        position_min_m=-0.05,
        position_max_m=0.05,
        velocity_m_s=1.0,
        acceleration_m_s2=50.0,
        force_n=2e4,
        current_min_a=0.0,
        current_max_a=2.0,
        temperature_max_degc=90.0,
        following_error_m=0.01,
    )
    return Identity(
        map_version=1,
        vendor="Maker",
        model="M25",
        serial="0815",
        channel_count=5,
        sample_rate_min_hz=1.0,
        sample_rate_max_hz=5000.0,
        fifo_samples=16384,
        capture_samples=16384,
        capabilities=Capability.CURRENT,
        limits=limits,
    )


def test_a_rig_under_every_spelling_is_one_rig_with_one_lease(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    for spelling in SPELLINGS:
        assert store.create(NewCampaign(**{**body, "rig": spelling})).rig == HERE
    [rig] = rigs.rigs()
    assert (rig.url, rig.accepted) == (HERE, 4)
    assert hold_rig(database, SPELLINGS[1], "worker 1", 20.0) is not None
    assert [hold_rig(database, spelling, "worker 2", 20.0) for spelling in SPELLINGS] == [None] * 4
    assert store.create(NewCampaign(**{**body, "rig": rig.rig.id})).rig_id == rig.rig.id
    for unknown in ("nobody", "5020"):
        with pytest.raises(InputError, match=f"rig is '{unknown}': no rig has this id"):
            store.create(NewCampaign(**{**body, "rig": unknown}))


def test_the_serial_number_makes_two_addresses_one_rig_and_holds_the_lease(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any], identity: Identity
) -> None:
    for address in (HERE, THERE):
        store.create(NewCampaign(**{**body, "rig": address}))
    first, second = (hold_rig(database, address, "worker", 20.0) for address in (HERE, THERE))
    assert first is not None
    assert second is not None
    first.identified(identity)
    assert first.lease.resource == "rig Maker/M25/0815"
    assert hold_rig(database, HERE, "other", 20.0) is None
    assert first.take_next() is not None
    with pytest.raises(Conflict, match=f"which is registered as {HERE}"):
        second.identified(identity)
    with pytest.raises(Conflict, match="Maker/M25/0816 answers, registered is Maker/M25/0815"):
        first.identified(replace(identity, serial="0816"))
    assert rigs.one("0815").worker == "worker"
    assert store.create(NewCampaign(**{**body, "rig": "0815"})).rig == HERE


def test_simulated_rigs_with_one_seed_are_two_rigs(database: Database, rigs: RigStore, identity: Identity) -> None:
    simulated = replace(identity, capabilities=Capability.SIMULATED)
    for address in (HERE, THERE):
        rigs.register(address, identity=simulated)
        rigs.register(address, identity=replace(simulated, serial="2"))
    assert [(one.rig.key, one.rig.serial) for one in rigs.rigs()] == [(HERE, "2"), (THERE, "2")]


def test_only_addresses_that_an_administrator_allows_are_taken() -> None:
    patterns = Settings().rig_patterns
    check_allowed(HERE, patterns)
    with pytest.raises(InputError, match=r"'modbus://10\.0\.0\.7:502' is not allowed here: an administrator adds it"):
        check_allowed("modbus://10.0.0.7:502", patterns)
    check_allowed("modbus://10.0.0.7:502", Settings(rigs_allowed="modbus://10.0.0.*:502").rig_patterns)


def test_a_queue_is_reordered_only_by_somebody_who_has_seen_it_as_it_is(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    a, b, c = (store.create(NewCampaign(**body)).id for _ in range(3))
    seen = rigs.queue(HERE)
    assert seen.campaigns == (a, b, c)
    assert rigs.move(seen.rig.id, c, to=0, version=seen.version, who="ann").campaigns == (c, a, b)
    with pytest.raises(Changed, match="has changed since it was read"):
        rigs.move(seen.rig.id, a, to=2, version=seen.version)
    d = store.create(NewCampaign(**body)).id
    store.delete(a)
    now = rigs.queue(HERE)
    assert now.campaigns == (c, b, d)
    held = hold_rig(database, HERE, "worker", 20.0)
    assert held is not None
    taken = held.take_next()
    assert taken is not None
    assert taken.id == c
    for moved in (c, a):
        with pytest.raises(Conflict, match="does not wait any more"):
            rigs.move(seen.rig.id, moved, to=0, version=rigs.queue(HERE).version)
    for delete, error in ((c, Conflict), (a, NotFound)):
        with pytest.raises(error):
            store.delete(delete)
    assert [(event.who, event.text) for event in rigs.events(HERE)] == [
        ("ann", "campaign 'two sines' moved to place 1")
    ]


def test_a_campaign_that_has_ended_is_repeated_as_a_new_one(store: CampaignStore, body: dict[str, Any]) -> None:
    first = store.create(NewCampaign(**body, oil="HLP 46"))
    with pytest.raises(Conflict, match="only one that has ended can be repeated"):
        store.retry(first.id)
    store.ask(first.id, Asked.STOP, "not now")
    again = store.retry(first.id, created_by="ann")
    assert (again.state.value, again.created_by, again.number > first.number) == ("accepted", "ann", True)
    same = ("name", "rig", "rig_id", "specimen", "setup", "interlocks", "envelopes", "warm_up")
    assert [getattr(again, name) for name in same] == [getattr(first, name) for name in same]
    assert [(test.config, test.state) for test in again.tests] == [(test.config, "waiting") for test in first.tests]


def test_a_rig_that_is_reserved_or_out_of_service_starts_only_what_it_should(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    others = store.create(NewCampaign(**body), created_by="bob")
    mine = store.create(NewCampaign(**body), created_by="ann")
    held = hold_rig(database, HERE, "worker", 20.0)
    assert held is not None
    rigs.reserve(HERE, who="ann", for_s=3600.0)
    with pytest.raises(Conflict, match="is reserved by ann"):
        rigs.reserve(HERE, who="bob", for_s=60.0)
    first = held.take_next()
    assert first is not None
    assert first.id == mine.id
    assert (held.take_next(), store.rigs_with_work()) == (None, (HERE,))
    rigs.change(HERE, out_of_service="the accumulator leaks", who="ann")
    rigs.release(HERE, who="bob")
    assert held.take_next() is None
    rigs.change(HERE, out_of_service=None)
    rigs.pause(HERE, "lunch", who="bob")
    assert held.take_next() is None
    rigs.resume(HERE, who="bob", reason="back")
    second = held.take_next()
    assert second is not None
    assert second.id == others.id
    said = [event.text for event in rigs.events(HERE)]
    assert (said[0], "queue paused: lunch" in said) == ("queue resumed: back (it was paused: lunch)", True)
