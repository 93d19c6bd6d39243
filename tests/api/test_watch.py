"""What stands between a streaming player and the store: the stream never waits, and a failure stops the rig in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any, NamedTuple

import pytest

from api.campaigns.desk import Desk
from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import Asked
from api.campaigns.records import Campaign
from api.campaigns.store import CampaignStore
from api.campaigns.watch import SHUTDOWN, STORE_AWAY, Watch
from api.errors import LeaseLost, StoreError
from api.store.database import Database
from rigctl.progress import Phase, Progress

RIG = "modbus://127.0.0.1:5020"
POLL_S = 0.01


class Lab(NamedTuple):
    """A campaign that a worker has taken."""

    database: Database
    store: CampaignStore
    held: HeldRig
    campaign: Campaign


@pytest.fixture
def lab(tmp_path: Path, body: dict[str, Any]) -> Iterator[Lab]:
    with Database(f"sqlite:///{tmp_path / 'campaigns.db'}") as database:
        CampaignStore(database).create(NewCampaign(**body))
        held = hold_rig(database, RIG, "worker 1", 20.0)
        assert held is not None
        campaign = held.take_next()
        assert campaign is not None
        yield Lab(database, CampaignStore(database), held, campaign)


def until(true: Callable[[], bool], within_s: float = 60.0) -> None:
    ends = time.monotonic() + within_s
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.002)


def progress(samples: int, phase: Phase = Phase.RUNNING) -> Progress:
    return Progress(test="slow", phase=phase, samples=samples, total_samples=500)


def test_progress_reaches_the_store_and_an_abort_the_player(lab: Lab) -> None:
    _, store, held, campaign = lab
    with Watch(held, campaign, Desk(RIG), stop=Event(), poll_s=POLL_S) as watch:
        watch.begin(0)
        watch.on_progress(progress(123))
        until(lambda: store.campaign(campaign.id).tests[0].samples == 123)
        assert watch.should_stop() is None
        store.abort(campaign.id, "wrong specimen")
        until(lambda: watch.should_stop() == "wrong specimen")
    assert watch.failure is None


def test_a_hold_its_end_and_a_stop_reach_the_player(lab: Lab) -> None:
    _, store, held, campaign = lab
    with Watch(held, campaign, Desk(RIG), stop=Event(), poll_s=POLL_S) as watch:
        assert not watch.should_hold()
        store.ask(campaign.id, Asked.HOLD, "over HTTP")
        until(watch.should_hold)
        store.ask(campaign.id, Asked.NOTHING, "over HTTP")
        until(lambda: not watch.should_hold())
        assert not watch.should_return()
        store.ask(campaign.id, Asked.STOP, "home")
        until(lambda: watch.should_stop() == "home")
        assert watch.should_return()
        store.abort(campaign.id, "now")
        until(lambda: not watch.should_return())
        assert watch.should_stop() == "home"


def test_a_stopping_service_stops_the_player_at_once(lab: Lab) -> None:
    _, _, held, campaign = lab
    stop = Event()
    with Watch(held, campaign, Desk(RIG), stop=stop, poll_s=60.0) as watch:
        assert watch.should_stop() is None
        stop.set()
        assert watch.should_stop() == SHUTDOWN


def test_a_lost_lease_stops_the_player_and_is_told(lab: Lab) -> None:
    database, _, held, campaign = lab
    with Watch(held, campaign, Desk(RIG), stop=Event(), poll_s=POLL_S) as watch:
        held.release()
        assert hold_rig(database, RIG, "worker 2", 20.0) is not None
        until(lambda: watch.should_stop() is not None)
    assert isinstance(watch.failure, LeaseLost)


class Silent(HeldRig):
    """A lease whose store does not answer any more."""

    def renew(self, campaign: Campaign) -> str | None:
        raise StoreError("the store does not answer")


def test_a_store_that_does_not_answer_is_tried_for_half_the_lease_and_no_longer(
    lab: Lab,
) -> None:
    database, _, held, campaign = lab
    now = [100.0]
    silent = Silent(database, RIG, held.lease)
    with Watch(silent, campaign, Desk(RIG), stop=Event(), poll_s=POLL_S, now=lambda: now[0]) as watch:
        now[0] += 9.0
        assert watch.should_stop() is None
        time.sleep(10 * POLL_S)  # the watch's own thread looks at the clock: let it
        assert watch.should_stop() is None
        now[0] += 2.0
        until(lambda: watch.should_stop() == STORE_AWAY)
    assert isinstance(watch.failure, StoreError)


def test_a_player_that_hangs_loses_its_lease(lab: Lab) -> None:
    database, _, held, campaign = lab
    now = [100.0]
    short = HeldRig(database, RIG, replace(held.lease, length_s=0.05))
    short.renew(campaign)
    with Watch(short, campaign, Desk(RIG), stop=Event(), poll_s=POLL_S, now=lambda: now[0]):
        now[0] += 1.0  # since the player's last call
        until(lambda: hold_rig(database, RIG, "worker 2", 20.0) is not None)
