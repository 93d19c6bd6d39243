"""Nothing moves unasked: the queue of a rig is paused, with its reason, until somebody resumes it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.queues import RESTARTED
from api.campaigns.records import Campaign, CampaignState, TestState
from api.campaigns.rig_store import RigStore
from api.campaigns.store import CampaignStore
from api.campaigns.worker import close_left_open
from api.errors import NotFound
from api.store.database import Database
from api.store.runs import RunStore
from rigctl.device import Control
from rigctl.player import connect
from tests.api.following import ended, post, reached, resume, rig_of, until
from tests.api.rigs import a_sim
from tests.starting import Started

RIG = "modbus://127.0.0.1:5020"
LEASE_S = 20.0
SHORT = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 3}


def paused(store: RigStore) -> str:
    [rig] = store.rigs()
    return rig.pause.reason if rig.pause else ""


def taken(database: Database, store: CampaignStore, body: dict[str, Any]) -> tuple[HeldRig, Campaign]:
    """A campaign that its worker has taken; two more wait."""
    for _ in range(3):
        store.create(NewCampaign(**body))
    held = hold_rig(database, RIG, "worker 1", LEASE_S)
    assert held is not None
    campaign = held.take_next()
    assert campaign is not None
    return held, campaign


def test_while_a_queue_is_paused_no_campaign_of_its_rig_is_taken_and_others_are(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    held, campaign = taken(database, store, body)
    held.end(campaign, CampaignState.FAILED, "the emergency stop was pressed", pauses=True)
    assert held.take_next() is None
    assert (paused(rigs), store.rigs_with_work()) == ("campaign 'two sines': the emergency stop was pressed", ())
    other = "modbus://127.0.0.1:5021"
    store.create(NewCampaign(**{**body, "rig": other}))
    assert store.rigs_with_work() == (other,)
    for _ in range(2):
        resumed = rigs.resume(RIG)
        assert (resumed.pause, resumed.accepted) == (None, 2)
    assert held.take_next() is not None
    with pytest.raises(NotFound, match="there is no rig 'modbus://nobody:5020'"):
        rigs.resume("modbus://nobody:5020")


def test_a_campaign_that_was_played_to_its_end_pauses_nothing_unless_its_end_was_asked_for(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    held, campaign = taken(database, store, body)
    held.end(campaign, CampaignState.DONE, "", pauses=False)
    second = held.take_next()
    assert (paused(rigs), second is not None) == ("", True)
    assert second is not None
    store.ask(second.id, Asked.STOP, "over HTTP")
    held.end(second, CampaignState.DONE, "", pauses=False)
    assert paused(rigs) == "campaign 'two sines': stop was asked for while it ended"
    assert held.take_next() is None


def test_a_restarted_service_pauses_every_rig_with_work_and_says_what_it_was_paused_for_before(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    idle = store.create(NewCampaign(**{**body, "rig": "modbus://127.0.0.1:5021"}))
    store.abort(idle.id, "")
    held, campaign = taken(database, store, body)
    for _ in range(2):
        rigs.pause_after_restart()
        assert [rig.pause.reason if rig.pause else "" for rig in rigs.rigs()] == [RESTARTED, ""]
    held.end(campaign, CampaignState.FAILED, "pump trip", pauses=True)
    for _ in range(2):
        rigs.pause_after_restart()
        assert rigs.rigs()[0].pause is not None
        assert rigs.rigs()[0].pause.reason == f"campaign 'two sines': pump trip; {RESTARTED}"


def test_after_the_death_of_its_worker_the_rig_is_unknown_and_its_queue_waits_also_if_it_was_resumed_too_early(
    database: Database,
    store: CampaignStore,
    rigs: RigStore,
    body: dict[str, Any],
    pass_time: Callable[[float], None],
    tmp_path: Path,
) -> None:
    taken(database, store, body)
    rigs.pause_after_restart()
    rigs.resume(RIG)
    pass_time(LEASE_S + 1)
    second = hold_rig(database, RIG, "worker 2", LEASE_S)
    assert second is not None
    close_left_open(second, RunStore(database, tmp_path))
    assert second.take_next() is None
    assert "what its rig has done since is unknown" in paused(rigs)


def test_a_campaign_that_could_not_begin_waits_in_its_place(
    database: Database, store: CampaignStore, rigs: RigStore, body: dict[str, Any]
) -> None:
    held, campaign = taken(database, store, body)
    held.progress(campaign, 0, "connecting", 0, "")
    held.put_back(campaign, "no answer")
    back = store.campaign(campaign.id)
    assert (back.state, back.started_at_s) == (CampaignState.ACCEPTED, None)
    assert {test.state for test in back.tests} == {TestState.WAITING}
    assert paused(rigs) == "campaign 'two sines' waits: no answer"
    rigs.resume(RIG)
    again = held.take_next()
    assert again is not None
    assert again.id == campaign.id
    store.abort(campaign.id, "not this one")
    held.put_back(campaign, "no answer")
    gone = store.campaign(campaign.id)
    assert (gone.state, gone.reason) == (CampaignState.ABORTED, "not this one")


def campaign_on(rig: str) -> dict[str, Any]:
    return {"name": "check", "rig": rig, "specimen": "damper 7", "tests": [{"name": "sine", **SHORT}]}


def test_one_emergency_stop_ends_one_campaign_and_the_others_wait_also_where_it_is_still_pressed(
    service: Started,
) -> None:
    with a_sim("modbus://127.0.0.1:0", "--speed", "10", "--fault", "emergency_stop@0.5") as rig:
        sent = [post(service.url, campaign_on(rig))["id"] for _ in range(3)]
        first = until(service.url, sent[0], ended)
        assert (first["state"], "the emergency stop was pressed" in first["reason"]) == ("failed", True)
        at_rest = rig_of(service.url, rig)
        assert (at_rest["accepted"], at_rest["running"]) == (2, None)
        assert "the emergency stop was pressed" in at_rest["paused"]
        resume(service.url, rig)
        asked = until(service.url, sent[1], lambda c: bool(c["question"]))
        assert "may the rig be reset?" in asked["question"]
        confirm = f"{service.url}/v1/campaigns/{sent[1]}/confirm"
        httpx.post(confirm, json={"answer": "yes"}, timeout=60).raise_for_status()
        again = reached(service.url, "/v1/rigs", lambda answer: answer["rigs"][0]["paused"] is not None)["rigs"][0]
        assert (again["accepted"], "waits" in again["paused"]) == (2, True)
        assert until(service.url, sent[1], lambda c: c["state"] == "accepted")["reason"] == ""


def test_a_rig_that_does_not_answer_or_that_another_host_commands_leaves_its_campaigns_waiting(
    service: Started, rig: str
) -> None:
    nowhere = "modbus://127.0.0.1:9"
    lost = post(service.url, campaign_on(nowhere))["id"]
    found = reached(service.url, "/v1/rigs", lambda answer: answer["rigs"][0]["paused"] is not None)["rigs"][0]
    assert (found["url"], found["accepted"], "127.0.0.1:9" in found["paused"]) == (nowhere, 1, True)
    assert until(service.url, lost, lambda c: c["state"] == "accepted")["tests"][0]["state"] == "waiting"
    with closing(connect(rig)) as other:
        other.claim(2.0)
        sent = post(service.url, campaign_on(rig))["id"]
        while rig_of(service.url, rig)["paused"] is None:
            other.command(Control.DISABLE, 0, 2.0)
        assert "another host commands the rig" in rig_of(service.url, rig)["paused"]
        other.release(2.0)
    resume(service.url, rig)
    assert until(service.url, sent, ended)["state"] == "done"
    assert rig_of(service.url, nowhere)["accepted"] == 1


def test_a_campaign_that_asks_its_operator_when_the_service_is_stopped_waits_for_the_next_service(
    service: Started, rig: str, tmp_path: Path
) -> None:
    before = [{"step": "prompt", "text": "Is the clevis fitted?"}]
    body = {**campaign_on(rig), "tests": [{"name": "sine", **SHORT, "before": before}]}
    sent = post(service.url, body)["id"]
    until(service.url, sent, lambda c: bool(c["question"]))
    assert service.stop() == 0
    with Database(f"sqlite:///{tmp_path / 'lab' / 'damper-rig.db'}") as database:
        store, rigs = CampaignStore(database), RigStore(database)
        assert (store.campaign(sent).state, store.campaign(sent).question) == (CampaignState.ACCEPTED, "")
        assert paused(rigs) == "campaign 'check' waits: the service was stopped"


def test_only_a_rig_that_a_campaign_names_can_be_resumed_and_the_answer_says_so(service: Started) -> None:
    for body, status in (({"rig": RIG}, 404), ({}, 422), ({"rig": RIG, "now": True}, 422)):
        assert httpx.post(f"{service.url}/v1/rigs/resume", json=body, timeout=30).status_code == status
