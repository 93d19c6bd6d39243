"""A worker that ends again and again is started later each time, which is said; an operator's word ends the wait."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path

import httpx
import pytest

from api.app import create_app
from api.campaigns.restarts import Restarts
from api.service import Service
from api.settings import Settings
from tests.api.following import Answer
from tests.api.serving import serving

RIG = "modbus://127.0.0.1:9"  # nobody answers there: its worker asks it all the same


class Ends:
    """A worker that ends, and how long the next one is waited for."""

    def __init__(self, restarts: Restarts) -> None:
        self._restarts, self._between = restarts, (0.0, 0.0)

    def end(self, lasted_s: float) -> None:
        before = time.time()
        self._restarts.ended("rig", lasted_s)
        self._between = before, time.time()

    def waits(self, wait_s: float) -> bool:
        at_s = self._restarts.next_s("rig")
        return at_s is not None and self._between[0] + wait_s <= at_s <= self._between[1] + wait_s


def test_each_wait_is_longer_until_one_has_lasted() -> None:
    restarts = Restarts(clock=lambda: 1000.0)
    ends = Ends(restarts)
    assert restarts.next_s("rig") is None
    for wait_s in (1.0, 2.0, 5.0, 15.0, 60.0, 60.0):
        ends.end(3.0)
        assert ends.waits(wait_s)
    assert restarts.next_s("another rig") is None
    ends.end(61.0)
    assert restarts.next_s("rig") is None
    ends.end(3.0)
    assert ends.waits(1.0)


def test_an_operator_who_resumes_the_queue_waits_for_nothing() -> None:
    restarts = Restarts(clock=lambda: 1000.0)
    ends = Ends(restarts)
    for paused in (False, True, True):
        ends.end(3.0)
        restarts.saw("rig", paused=paused)
        assert restarts.next_s("rig") is not None
    restarts.saw("rig", paused=False)
    assert restarts.next_s("rig") is None
    ends.end(3.0)
    assert ends.waits(1.0)


@pytest.fixture
def client(tmp_path: Path) -> Iterator[httpx.Client]:
    """A service on which no time passes for the next worker: only an operator ends its wait."""
    app = create_app(Settings(data_dir=tmp_path / "lab", poll_s=0.05))
    with serving(app) as client:
        service = app.state.service
        assert isinstance(service, Service)
        service.restarts.clock = lambda: 0.0
        yield client


def test_a_rig_says_when_its_next_worker_starts_and_a_resumed_queue_has_it_at_once(client: httpx.Client) -> None:
    client.post("/v1/rigs", json={"address": RIG}).raise_for_status()
    first = reached(client, lambda rig: rig["worker"] and rig["state"] == "unreachable")
    assert first["worker_again_at"] is None
    os.kill(int(first["worker"].split(":")[1]), signal.SIGKILL)
    waiting = reached(client, lambda rig: rig["worker_again_at"] and rig["paused"] and not rig["worker"])
    assert waiting["state"] == "unknown"
    at = datetime.fromisoformat(waiting["worker_again_at"])
    assert f"asked again at {at:%Y-%m-%d %H:%M:%S} UTC, or at once when its queue is resumed" in waiting["state_text"]
    client.post("/v1/rigs/resume", json={"rig": RIG}).raise_for_status()
    again = reached(client, lambda rig: rig["worker"] and rig["state"] == "unreachable")
    assert (again["worker_again_at"], again["paused"]) == (None, None)
    assert again["worker"] != first["worker"]


def reached(client: httpx.Client, is_there: Callable[[Answer], object]) -> Answer:
    ends = time.monotonic() + 60
    while True:
        rig: Answer = client.get("/v1/rigs").json()["rigs"][0]
        if is_there(rig):
            return rig
        assert time.monotonic() < ends, rig
        time.sleep(0.05)
