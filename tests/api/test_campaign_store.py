"""Campaigns in the store, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from api.campaigns.envelopes import check_campaign, envelopes_of, service_envelopes
from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked, Order
from api.campaigns.records import CampaignState, TestState
from api.campaigns.rig_store import RigStore
from api.campaigns.store import CampaignStore
from api.campaigns.worker import close_left_open
from api.errors import Conflict, LeaseLost, NotFound
from api.findings import Refused
from api.settings import Settings
from api.store.database import Database
from api.store.runs import RunRecord, RunStore
from excitation.errors import DesignError

RIG = "modbus://127.0.0.1:5020"
LEASE_S = 20.0


def leased(database: Database, owner: str = "worker 1") -> HeldRig:
    held = hold_rig(database, RIG, owner, LEASE_S)
    assert held is not None
    return held


def a_run(campaign_id: str) -> RunRecord:
    return RunRecord(
        id="r1",
        campaign_id=campaign_id,
        test="slow",
        held_out=False,
        status="complete",
        location="x/slow.h5",
        size_bytes=10,
        sha256="0" * 64,
        samples=500,
        sample_rate_hz=1000.0,
        created="2026-11-21T00:00:00+00:00",
    )


def test_an_accepted_campaign_reads_back_as_it_was_asked_for(store: CampaignStore, body: dict[str, Any]) -> None:
    campaign = store.create(NewCampaign(**body))
    assert campaign == store.campaign(campaign.id)
    assert campaign.state is CampaignState.ACCEPTED
    assert [dict(test.config) for test in campaign.tests] == body["tests"]
    assert [test.held_out for test in campaign.tests] == [False, True]
    assert [test.total_samples for test in campaign.tests] == [500, 250]
    assert [event.text for event in store.events(campaign.id)] == ["accepted"]


def test_campaigns_of_a_rig_are_taken_in_the_order_of_acceptance(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    asked = [store.create(NewCampaign(**{**body, "name": f"c{k}"})).name for k in range(3)]
    other = store.create(NewCampaign(**{**body, "rig": "modbus://127.0.0.1:5021"}))
    held = leased(database)
    taken = [campaign.name for campaign in iter(held.take_next, None)]
    assert taken == asked
    assert store.campaign(other.id).state is CampaignState.ACCEPTED


def test_a_rig_has_one_worker_until_it_lets_go_or_dies(database: Database, pass_time: Callable[[float], None]) -> None:
    first = leased(database)
    assert hold_rig(database, RIG, "worker 2", LEASE_S) is None
    first.release()
    second = leased(database, "worker 2")
    pass_time(LEASE_S + 1)
    third = leased(database, "worker 3")
    assert len({held.lease.token for held in (first, second, third)}) == 3


def test_of_many_workers_that_ask_at_once_exactly_one_gets_the_rig(database: Database) -> None:
    with ThreadPoolExecutor(8) as pool:
        got = list(pool.map(lambda k: hold_rig(database, RIG, f"worker {k}", LEASE_S), range(8)))
    assert sum(held is not None for held in got) == 1


def test_whoever_lost_the_lease_can_write_nothing(
    database: Database, store: CampaignStore, body: dict[str, Any], pass_time: Callable[[float], None]
) -> None:
    campaign = store.create(NewCampaign(**body))
    late = leased(database)
    late.take_next()
    pass_time(LEASE_S + 1)
    leased(database, "worker 2")
    before = store.campaign(campaign.id)
    for write in (
        late.take_next,
        late.left_open,
        lambda: late.renew(campaign),
        lambda: late.progress(campaign, 0, "running", 1, ""),
        lambda: late.end_test(campaign, 0, TestState.DONE, ""),
        lambda: late.add_run(campaign, a_run(campaign.id)),
        lambda: late.end(campaign, CampaignState.DONE, "", pauses=False),
    ):
        with pytest.raises(LeaseLost):
            write()
    late.release()
    assert hold_rig(database, RIG, "worker 3", LEASE_S) is None
    assert store.campaign(campaign.id) == before
    assert RunStore(database, Path()).of_campaign(campaign.id) == ()


def test_a_lease_that_ran_out_but_that_nobody_took_is_still_held(
    database: Database, store: CampaignStore, body: dict[str, Any], pass_time: Callable[[float], None]
) -> None:
    campaign = store.create(NewCampaign(**body))
    held = leased(database)
    held.take_next()
    pass_time(10 * LEASE_S)
    held.end(campaign, CampaignState.DONE, "", pauses=False)
    assert store.campaign(campaign.id).state is CampaignState.DONE


def test_a_campaign_whose_worker_died_is_closed_as_failed_by_the_next_worker(
    database: Database, store: CampaignStore, body: dict[str, Any], pass_time: Callable[[float], None], tmp_path: Path
) -> None:
    campaign = store.create(NewCampaign(**body))
    dead = leased(database)
    dead.take_next()
    dead.progress(campaign, 0, "running", 100, "")
    pass_time(LEASE_S + 1)
    second = leased(database, "worker 2")
    assert [c.id for c in second.left_open()] == [campaign.id]
    close_left_open(second, RunStore(database, tmp_path))
    closed = store.campaign(campaign.id)
    assert closed.state is CampaignState.FAILED
    assert "did not renew its lease" in closed.reason
    assert [test.state for test in closed.tests] == [TestState.FAILED, TestState.SKIPPED]
    assert second.left_open() == ()


def test_an_abort_ends_a_waiting_campaign_at_once_and_can_be_repeated(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    campaign = store.create(NewCampaign(**body))
    for _ in range(2):
        aborted = store.abort(campaign.id, "wrong specimen")
        assert (aborted.state, aborted.reason) == (CampaignState.ABORTED, "wrong specimen")
    assert {test.state for test in aborted.tests} == {TestState.SKIPPED}
    assert leased(database).take_next() is None


def test_an_abort_of_a_running_campaign_reaches_its_worker(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    campaign = store.create(NewCampaign(**body))
    held = leased(database)
    held.take_next()
    assert held.renew(campaign) == Order()
    for reason in ("first", "second"):
        assert store.abort(campaign.id, reason).state is CampaignState.RUNNING
    assert held.renew(campaign) == Order(asked=Asked.ABORT, reason="first")


def test_what_is_asked_of_a_running_campaign_can_be_taken_back_until_it_ends(
    database: Database, store: CampaignStore, body: dict[str, Any]
) -> None:
    campaign = store.create(NewCampaign(**body))
    for wish in (Asked.HOLD, Asked.NOTHING):
        with pytest.raises(Conflict, match="is accepted: only a running one can"):
            store.ask(campaign.id, wish, "")
    held = leased(database)
    held.take_next()
    for wish in (Asked.HOLD, Asked.HOLD, Asked.NOTHING, Asked.NOTHING, Asked.HOLD):
        assert store.ask(campaign.id, wish, "over HTTP").asked is wish
        assert held.renew(campaign) == Order(asked=wish)
    for wish, asked, reason in [
        (Asked.STOP, Asked.STOP, "stop"),
        (Asked.STOP, Asked.STOP, "stop"),
        (Asked.ABORT, Asked.ABORT, "abort"),
        (Asked.STOP, Asked.ABORT, "abort"),
    ]:
        assert store.ask(campaign.id, wish, str(wish)).asked is asked
        assert held.progress(campaign, 0, "running", 1, "") == Order(asked=asked, reason=reason)
    for wish in (Asked.HOLD, Asked.NOTHING):
        with pytest.raises(Conflict, match="is ending, abort was asked for"):
            store.ask(campaign.id, wish, "")
    told = [event.text for event in store.events(campaign.id) if "asked for" in event.text]
    assert told == [f"{what} asked for: {why}" for what, why in ASKED_FOR]
    held.end(campaign, CampaignState.ABORTED, "abort", pauses=False)
    assert store.campaign(campaign.id).asked is Asked.NOTHING
    with pytest.raises(Conflict, match="is aborted"):
        store.ask(campaign.id, Asked.HOLD, "")


ASKED_FOR = [
    ("hold", "over HTTP"),
    ("resume", "over HTTP"),
    ("hold", "over HTTP"),
    ("stop", "stop"),
    ("abort", "abort"),
]


@pytest.mark.parametrize("state", [CampaignState.DONE, CampaignState.FAILED])
def test_an_ended_campaign_cannot_be_aborted(
    database: Database, store: CampaignStore, body: dict[str, Any], state: CampaignState
) -> None:
    campaign = store.create(NewCampaign(**body))
    held = leased(database)
    held.take_next()
    held.end(campaign, state, "", pauses=False)
    with pytest.raises(Conflict, match=str(state)):
        store.abort(campaign.id, "too late")


def test_what_does_not_exist_is_not_found(store: CampaignStore) -> None:
    for look in (store.campaign, store.events, lambda name: store.abort(name, "")):
        with pytest.raises(NotFound, match="nobody"):
            look("nobody")


def test_rigs_tell_who_drives_them_and_what_waits(
    database: Database,
    store: CampaignStore,
    rigs: RigStore,
    body: dict[str, Any],
    pass_time: Callable[[float], None],
) -> None:
    first = store.create(NewCampaign(**body))
    store.create(NewCampaign(**body))
    assert store.rigs_with_work() == (RIG,)
    leased(database).take_next()
    [rig] = rigs.rigs()
    assert (rig.url, rig.worker, rig.running, rig.accepted) == (RIG, "worker 1", first.id, 1)
    pass_time(LEASE_S + 1)
    assert rigs.rigs()[0].worker == ""


def test_the_list_is_newest_first_in_pages_and_by_state(store: CampaignStore, body: dict[str, Any]) -> None:
    made = [store.create(NewCampaign(**body)) for _ in range(5)]
    store.abort(made[2].id, "")
    page = store.campaigns(limit=2)
    assert [c.id for c in page] == [made[4].id, made[3].id]
    assert [c.id for c in store.campaigns(limit=2, before=page[-1].number)] == [made[2].id, made[1].id]
    assert [c.id for c in store.campaigns(state=CampaignState.ABORTED)] == [made[2].id]


DOES = ["create", "take", "test", "hold", "abort", "end", "put back", "resume", "die"]
STEPS = st.lists(st.sampled_from(DOES), max_size=12)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(steps=STEPS)
def test_whatever_happens_the_record_of_every_campaign_is_true(
    database: Database,
    store: CampaignStore,
    rigs: RigStore,
    body: dict[str, Any],
    pass_time: Callable[[float], None],
    tmp_path: Path,
    steps: list[str],
) -> None:
    """Ended campaigns stay as they ended; no more than one runs, none starts in a paused queue; none is lost."""
    pass_time(2 * LEASE_S)
    held, running = leased(database), None
    close_left_open(held, RunStore(database, tmp_path))
    made = {c.id for c in store.campaigns(limit=200)}
    ended = {c.id: c for c in store.campaigns(limit=200) if c.ended_at_s is not None}
    for step in steps:
        match step:
            case "create":
                made.add(store.create(NewCampaign(**body)).id)
            case "take" if running is None:
                paused = any(rig.pause for rig in rigs.rigs())
                running = held.take_next()
                assert not (paused and running)
            case "test" if running is not None:
                held.end_test(running, 0, TestState.DONE, "")
            case "hold" if running is not None:
                with suppress(Conflict):
                    store.ask(running.id, Asked.HOLD, "asked")
            case "abort" if running is not None:
                store.abort(running.id, "asked")
            case "end" if running is not None:
                reason = held.renew(running).reason
                held.end(running, CampaignState.ABORTED if reason else CampaignState.DONE, reason or "", pauses=False)
                running = None
            case "put back" if running is not None:
                held.put_back(running, "no answer")
                running = None
            case "resume" if made:
                rigs.resume(RIG)
            case "die":
                pass_time(2 * LEASE_S)
                held, running = leased(database, "next"), None
                close_left_open(held, RunStore(database, tmp_path))
        now = {c.id: c for c in store.campaigns(limit=200)}
        assert set(now) == made
        assert sum(c.state is CampaignState.RUNNING for c in now.values()) == (running is not None)
        assert all(now[key] == campaign for key, campaign in ended.items())
        ended = {c.id: c for c in now.values() if c.ended_at_s is not None}


def test_the_envelopes_of_a_campaign_are_checked_stored_and_hold_beside_those_of_the_service(
    store: CampaignStore, body: dict[str, Any], tmp_path: Path
) -> None:
    wide = {"motion": {"max_displacement": 0.05, "max_velocity": 1.0}}
    small = {"name": "small", "motion": {"max_displacement": 0.004, "max_velocity": 1.0}}
    with pytest.raises(Refused, match="test 'slow' exceeds the rig: displacement"):
        NewCampaign(**{**body, "envelopes": [wide, small]})
    with pytest.raises(Refused, match=r"envelopes\[0\]"):
        NewCampaign(**{**body, "envelopes": [{"motion": {"max_speed": 1.0}}]})
    made = store.create(NewCampaign(**{**body, "envelopes": [wide]}))
    (tmp_path / "rig.toml").write_text("[motion]\nmax_displacement = 0.004\nmax_velocity = 2.0\n")
    service = service_envelopes(Settings(envelopes=str(tmp_path / "rig.toml")))
    held = envelopes_of(store.campaign(made.id), service)
    assert [one.motion.max_displacement_m for one in held] == [0.004, 0.05]
    with pytest.raises(Refused, match="displacement"):
        check_campaign(NewCampaign(**body).plan, service)
    with pytest.raises(DesignError, match=r"absent\.toml"):
        service_envelopes(Settings(envelopes=str(tmp_path / "absent.toml")))
