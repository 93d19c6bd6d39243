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


def waits(restarts: Restarts) -> float | None:
    at_s = restarts.next_s("rig")
    return None if at_s is None else at_s - time.time()


def test_each_wait_is_longer_until_one_has_lasted() -> None:
    restarts = Restarts(clock=lambda: 1000.0)
    assert waits(restarts) is None
    for wait_s in (1.0, 2.0, 5.0, 15.0, 60.0, 60.0):
        restarts.ended("rig", 3.0)
        assert waits(restarts) == pytest.approx(wait_s, abs=0.5)
    assert restarts.next_s("another rig") is None
    restarts.ended("rig", 61.0)
    assert waits(restarts) is None
    restarts.ended("rig", 3.0)
    assert waits(restarts) == pytest.approx(1.0, abs=0.5)


def test_an_operator_who_resumes_the_queue_waits_for_nothing() -> None:
    restarts = Restarts(clock=lambda: 1000.0)
    for paused in (False, True, True):
        restarts.ended("rig", 3.0)
        restarts.saw("rig", paused=paused)
        assert waits(restarts) is not None
    restarts.saw("rig", paused=False)
    assert waits(restarts) is None
    restarts.ended("rig", 3.0)
    assert waits(restarts) == pytest.approx(1.0, abs=0.5)


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
