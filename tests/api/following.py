"""Following a campaign or a job over HTTP until it has ended or is where a test wants it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import httpx

Answer = dict[str, Any]

TRUSTED = httpx.create_ssl_context()  # made once: a client that makes its own takes longer for it than to ask


def post(base: str, body: Answer) -> Answer:
    response = httpx.post(f"{base}/v1/campaigns", json=body, timeout=30, verify=TRUSTED)
    assert response.status_code == 201, response.text
    answer: Answer = response.json()
    return answer


def get(base: str, path: str) -> Answer:
    response = httpx.get(f"{base}{path}", timeout=30, verify=TRUSTED)
    assert response.status_code == 200, response.text
    answer: Answer = response.json()
    return answer


def until(base: str, campaign_id: str, is_there: Callable[[Answer], bool], within_s: float = 180.0) -> Answer:
    return reached(base, f"/v1/campaigns/{campaign_id}", is_there, within_s)


def reached(base: str, path: str, is_there: Callable[[Answer], bool], within_s: float = 180.0) -> Answer:
    ends = time.monotonic() + within_s
    while not is_there(answer := get(base, path)):
        assert time.monotonic() < ends, f"not there within {within_s} s: {answer}"
        time.sleep(0.05)
    return answer


def ended(campaign: Answer) -> bool:
    return campaign["ended"] is not None


def playing(campaign: Answer) -> bool:
    return any(test["state"] == "running" and test["samples"] > 0 for test in campaign["tests"])


def states(campaign: Answer) -> list[str]:
    return [test["state"] for test in campaign["tests"]]


def rig_of(base: str, url: str) -> Answer:
    """The rig with this address as the service shows it."""
    [rig] = [rig for rig in get(base, "/v1/rigs")["rigs"] if rig["url"] == url]
    answer: Answer = rig
    return answer


def until_rig(base: str, url: str, is_there: Callable[[Answer], bool], within_s: float = 60.0) -> Answer:
    """The rig with this address as soon as it is where a test wants it."""
    reached(base, "/v1/rigs", lambda answer: any(r["url"] == url and is_there(r) for r in answer["rigs"]), within_s)
    return rig_of(base, url)


def worker_of(base: str, url: str) -> int:
    """The process id of the worker of a rig, as its lease says."""
    return int(rig_of(base, url)["worker"].split(":")[1])


def resume(base: str, rig: str) -> None:
    """Resume the queue of a rig."""
    response = httpx.post(f"{base}/v1/rigs/resume", json={"rig": rig}, timeout=30, verify=TRUSTED)
    assert response.status_code == 200, response.text
    assert response.json()["paused"] is None
