"""A campaign asks its operator and waits; what is in the rig travels in its run files."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.records import Campaign, CampaignState
from api.campaigns.store import CampaignStore
from api.errors import Conflict, LeaseLost, NotFound
from api.findings import Refused
from api.store.database import Database
from rigctl.runfile import read_run
from tests.api.following import ended, get, post, states, until
from tests.starting import Started

SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "current": 0.5, "cycles": 2}
TODAY = datetime.now(UTC).date()
CELL = {
    "channel": "force",
    "serial": "LC-1",
    "date": (TODAY - timedelta(days=30)).isoformat(),
    "expires": (TODAY + timedelta(days=30)).isoformat(),
    "scale": 1.01,
}
PREPARED = {
    "operator": "A. Meyer",
    "specimen_serial": "7",
    "fixture": "clevis",
    "oil": "ISO VG 32",
    "calibrations": [CELL],
}


def running(database: Database, body: dict[str, Any], owner: str = "w") -> tuple[CampaignStore, HeldRig, Campaign]:
    store = CampaignStore(database)
    store.create(NewCampaign(**body))
    held = hold_rig(database, body["rig"], owner, 20.0)
    assert held is not None
    campaign = held.take_next()
    assert campaign is not None
    return store, held, campaign


def test_a_question_is_shown_until_it_is_answered_once(database: Database, body: dict[str, Any]) -> None:
    store, held, campaign = running(database, body)
    assert store.campaign(campaign.id).question == ""
    with pytest.raises(Conflict, match="asks nothing"):
        store.answer(campaign.id, "yes")
    held.ask(campaign, "Is the clevis fitted?")
    assert (store.campaign(campaign.id).question, held.answer(campaign)) == ("Is the clevis fitted?", None)
    with pytest.raises(Conflict, match="asks another question by now: Is the clevis fitted"):
        store.answer(campaign.id, "yes", "May the rig be reset?")
    assert held.answer(campaign) is None
    assert store.answer(campaign.id, "yes", "Is the clevis fitted?").question == ""
    assert held.answer(campaign) == "yes"
    with pytest.raises(Conflict, match="asks nothing"):
        store.answer(campaign.id, "no")
    held.ask(campaign, "Temperature of the room, °C")
    assert held.answer(campaign) is None, "an earlier answer is forgotten"
    held.close_question(campaign)
    assert store.campaign(campaign.id).question == ""
    texts = [event.text for event in store.events(campaign.id)]
    assert "asks the operator: Is the clevis fitted?" in texts
    assert "answered 'yes': Is the clevis fitted?" in texts


def test_an_ended_campaign_asks_nothing_and_a_lost_one_cannot_ask(
    database: Database, body: dict[str, Any], pass_time: Callable[[float], None]
) -> None:
    store, held, campaign = running(database, body)
    held.ask(campaign, "Ready?")
    held.end(campaign, CampaignState.ABORTED, "enough", pauses=False)
    assert store.campaign(campaign.id).question == ""
    with pytest.raises(Conflict):
        store.answer(campaign.id, "yes")
    with pytest.raises(NotFound):
        store.answer("0" * 32, "yes")
    pass_time(100.0)
    assert hold_rig(database, body["rig"], "other", 20.0) is not None
    with pytest.raises(LeaseLost):
        held.ask(campaign, "Ready?")


def test_what_is_in_the_rig_reads_back_and_is_checked_when_it_is_accepted(
    store: CampaignStore, body: dict[str, Any]
) -> None:
    assert store.create(NewCampaign(**body)).setup == {}
    assert store.create(NewCampaign(**body, **PREPARED)).setup == PREPARED
    with pytest.raises(Refused, match=r"LC-1\) expired on"):
        NewCampaign(**body, calibrations=[{**CELL, "expires": (TODAY - timedelta(days=1)).isoformat()}])
    with pytest.raises(Refused, match="gain"):
        NewCampaign(**body, calibrations=[{**CELL, "gain": 1.0}])


def test_a_campaign_waits_for_its_operator_and_records_what_was_done(
    service: Started, rig: str, tmp_path: Path
) -> None:
    room = {"step": "gate", "of": "ambient", "min": 18.0, "max": 28.0}
    tests = [
        {**SINE, "name": "first", "before": [{"step": "prompt", "text": "Is the clevis fitted?"}, room]},
        {**SINE, "name": "second", "before": [{"step": "gate", "of": "oil", "min": 300.0}], "on_failure": "skip"},
        {**SINE, "name": "third", "before": [{"step": "tare", "readings": 40}]},
        {**SINE, "name": "fourth", "before": [{"step": "prompt", "text": "Is it still fitted?"}]},
    ]
    sent = post(service.url, {"name": "asked", "rig": rig, "specimen": "d", "tests": tests, **PREPARED})
    asked = until(service.url, sent["id"], lambda c: bool(c["question"]))
    assert (asked["question"], asked["tests"][0]["phase"]) == ("Is the clevis fitted?", "waiting")
    answer(service.url, sent["id"], "yes")
    until(service.url, sent["id"], lambda c: "Temperature of the room" in c["question"])
    answer(service.url, sent["id"], "warm")
    until(service.url, sent["id"], lambda c: "'warm' is no number" in c["question"])
    answer(service.url, sent["id"], "21.5")
    until(service.url, sent["id"], lambda c: c["question"] == "Is it still fitted?")
    answer(service.url, sent["id"], "no")
    done = until(service.url, sent["id"], ended)
    assert (done["state"], states(done)) == ("aborted", ["done", "skipped", "done", "aborted"]), done
    assert "did not confirm" in done["reason"]
    assert "300 °C" in done["tests"][1]["text"]
    runs = get(service.url, f"/v1/campaigns/{sent['id']}/runs")["runs"]
    path = tmp_path / "first.h5"
    path.write_bytes(httpx.get(service.url + runs[0]["file"], timeout=60).content)
    run = read_run(path)
    assert (run.operator, run.setup.fixture, run.setup.ambient_degc) == ("A. Meyer", "clevis", 21.5)
    assert run.setup.calibrations[0].serial == "LC-1"
    assert len(run.events_utc) == len(run.events)
    response = httpx.post(f"{service.url}/v1/campaigns/{sent['id']}/confirm", json={}, timeout=30)
    assert response.status_code == 409


def answer(base: str, campaign_id: str, text: str) -> None:
    response = httpx.post(f"{base}/v1/campaigns/{campaign_id}/confirm", json={"answer": text}, timeout=30)
    assert response.status_code == 202, response.text
