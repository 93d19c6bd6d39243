"""A stop needs no store, no thread of a pool and no body, and nobody is told more than was seen."""

from __future__ import annotations

import os
import signal
import socket
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.line.place import places
from rigctl.address import connect
from rigctl.device import Control, RigState
from rigctl.limits import Configuration
from tests.api.following import ended, get, playing, post, reached, resume, rig_of, until, until_rig, worker_of

LONG = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 400}
SHORT = {**LONG, "cycles": 3}
# The service goes past a worker that has not answered for 0.06 s: on a busy computer none may.
BY = ("worker", "service")


def campaign_on(rig: str, *tests: dict[str, Any]) -> dict[str, Any]:
    named = [{"name": f"test {k}", **test} for k, test in enumerate(tests or (LONG,))]
    return {"name": "check", "rig": rig, "specimen": "damper 7", "tests": named}


@pytest.fixture
def running(base: str, rig: str) -> Iterator[str]:
    """The id of a campaign whose test moves the rig."""
    begun = post(base, campaign_on(rig))["id"]
    resume(base, rig)
    until(base, begun, playing)
    yield begun
    httpx.post(f"{base}/v1/campaigns/{begun}/abort", timeout=30)
    until(base, begun, ended)


def state_of(rig: str) -> RigState:
    with closing(connect(rig)) as wire:
        return wire.status(2.0).state


@contextmanager
def locked(data: Path) -> Iterator[None]:
    """The store, written by somebody who does not finish."""
    with closing(sqlite3.connect(data / "damper-rig.db", isolation_level=None, timeout=30.0)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        yield
        connection.execute("ROLLBACK")


def test_a_stop_reaches_the_rig_while_the_store_is_locked_and_the_record_follows(
    base: str, lab: Path, rig: str, running: str
) -> None:
    with locked(lab / "data"):
        answer = httpx.post(f"{base}/v1/campaigns/{running}/stop", timeout=60)  # it is locked until the rig has stopped
        assert (answer.status_code, answer.json()["acknowledged"]) == (202, True)
        assert answer.json()["by"] in BY
        assert (answer.json()["id"], answer.json()["asked"], answer.json()["name"]) == (running, "stop", "check")
        ends = time.monotonic() + 60
        while state_of(rig) is not RigState.DISABLED:
            assert time.monotonic() < ends
            time.sleep(0.02)
    stopped = until(base, running, ended)
    assert (stopped["state"], stopped["reason"]) == ("aborted", "a stop was requested over HTTP")
    assert rig_of(base, rig)["paused"] == "campaign 'check': a stop was requested over HTTP"


def test_a_rig_whose_worker_was_killed_is_stopped_past_it_and_unknown_until_it_is_asked(
    base: str, rig: str, running: str
) -> None:
    known = rig_of(base, rig)
    assert (known["state"], known["running"], known["progress"]["test"]) == ("running", running, "test 0")
    os.kill(worker_of(base, rig), signal.SIGKILL)
    killed = datetime.now(UTC)
    seen: list[dict[str, Any]] = []

    def unknown_or_asked_again(answer: dict[str, Any]) -> bool:
        seen.append(next(r for r in answer["rigs"] if r["url"] == rig))
        return seen[-1]["state"] == "unknown" or datetime.fromisoformat(seen[-1]["known_at"]) > killed

    with ThreadPoolExecutor(
        1
    ) as pool:  # a simulated rig that waits for its host stops after 5 s: a new worker is faster
        abort = pool.submit(httpx.post, f"{base}/v1/campaigns/{running}/abort", timeout=30)
        reached(base, "/v1/rigs", unknown_or_asked_again)
    answer = abort.result()
    assert (answer.status_code, answer.json()["acknowledged"], answer.json()["safe"]) == (202, True, True), answer.text
    assert answer.json()["by"] == "service"
    assert {r["state"] for r in seen[:-1]} <= {"running"}
    if seen[-1]["state"] == "unknown":
        assert "what the rig has done since is unknown" in seen[-1]["state_text"]
        assert datetime.fromisoformat(seen[-1]["known_at"]) <= killed
    assert state_of(rig) in (RigState.DISABLED, RigState.FAULT_DISABLED)
    closed = until(base, running, ended)
    assert closed["state"] == "failed"
    assert "what its rig has done since is unknown" in rig_of(base, rig)["paused"]
    until_rig(base, rig, lambda r: r["state"] in ("free", "latched fault"))


def test_make_safe_says_that_the_rig_is_off_and_without_current_while_a_test_runs(
    base: str, rig: str, running: str
) -> None:
    rig_id = rig_of(base, rig)["id"]
    answer = httpx.post(f"{base}/v1/rigs/{rig_id}/make-safe", timeout=30)
    assert (answer.status_code, answer.json()["safe"]) == (200, True), answer.text
    with closing(connect(rig)) as wire:
        status = wire.status(2.0)
    assert (status.state, abs(status.current_a) < 0.02, status.arrived) == (RigState.DISABLED, True, True)
    assert until(base, running, ended)["reason"] == "make safe was requested over HTTP"
    assert "make safe was requested over HTTP" in rig_of(base, rig)["paused"]


def test_a_rig_that_nobody_plays_on_is_stopped_and_its_queue_pauses(base: str, rig: str) -> None:
    post(base, campaign_on(rig, SHORT))
    rig_id = until_rig(base, rig, lambda r: r["state"] == "free")["id"]
    with closing(connect(rig)) as other:
        other.claim(2.0)
        other.configure(Configuration(heartbeat_s=10.0), 2.0)  # it is silent until the stop comes
        until_rig(base, rig, lambda r: r["state"] == "occupied")
        other.command(Control.HOLD, 0, 2.0)
        assert httpx.post(f"{base}/v1/rigs/{rig_id}/stop", timeout=30).status_code == 202
    assert state_of(rig) is RigState.DISABLED
    until_rig(base, rig, lambda r: "a stop of the rig was requested over HTTP" in (r["paused"] or ""))
    assert httpx.post(f"{base}/v1/rigs/nobody/stop", timeout=30).status_code == 404
    until_rig(base, rig, lambda r: r["state"] == "free")


def test_hold_is_acknowledged_when_the_piston_rests(base: str, rig: str, running: str) -> None:
    assert httpx.post(f"{base}/v1/campaigns/{running}/hold", timeout=30).status_code == 202
    seen: list[str] = []

    def held(answer: dict[str, Any]) -> bool:
        seen.append(next(r["state"] for r in answer["rigs"] if r["url"] == rig))
        return seen[-1] == "held"

    reached(base, "/v1/rigs", held)
    with closing(connect(rig)) as wire:
        status = wire.status(2.0)
    assert (status.state, status.arrived) == (RigState.HOLD, True)
    assert set(seen) <= {"running", "holding", "held"}


def test_the_secret_of_a_line_is_for_this_user_alone_and_whoever_does_not_know_it_orders_nothing(
    base: str, lab: Path, rig: str, running: str
) -> None:
    folder = lab / "data" / "workers"
    place = next(place for place in places(folder) if place.address == rig)
    assert (folder / f"{place.rig_id}.json").stat().st_mode & 0o077 == 0
    with socket.create_connection(("127.0.0.1", place.port), timeout=30) as stranger:
        stranger.recv(1000)
        stranger.sendall(b'{"proof": "0", "nonce": "1"}\n{"n": 1, "do": "abort", "reason": "stranger"}\n')
        assert stranger.recv(1000) == b""
    assert get(base, f"/v1/campaigns/{running}")["state"] == "running"


def test_a_page_of_another_site_stops_nothing(base: str, running: str) -> None:
    other = {"origin": "http://elsewhere.example"}
    refused = httpx.post(f"{base}/v1/campaigns/{running}/stop", headers=other, timeout=30)
    assert refused.status_code == 403
    assert get(base, f"/v1/campaigns/{running}")["state"] == "running"
