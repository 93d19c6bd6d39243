"""A service or a worker without descriptors: it says so in one line, and a stop reaches the rig all the same."""

from __future__ import annotations

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from rigctl.address import connect
from rigctl.device import RigState
from tests.api.following import ended, get, playing, post, reached, resume, rig_of, until, until_rig, worker_of
from tests.starting import Started

LONG = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 400}
SHORT = {**LONG, "cycles": 3}
# The service goes past a worker that has not answered for 0.06 s: on a busy computer none may.
BY = ("worker", "service")

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the descriptors of another process")


def campaign_of(rig: str, *tests: dict[str, Any]) -> dict[str, Any]:
    named = [{"name": f"test {k}", **test} for k, test in enumerate(tests)]
    return {"name": "check", "rig": rig, "specimen": "damper 7", "tests": named}


@contextmanager
def no_more_descriptors(pid: int, left: int = 0) -> Iterator[None]:
    """Let a process open ``left`` files more than it has open; a socket is a file."""
    used = sorted(int(entry.name) for entry in Path(f"/proc/{pid}/fd").iterdir())
    free = [number for number in range(used[-1] + left + 2) if number not in used]
    before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (free[left], before[1]))
    try:
        yield
    finally:
        resource.prlimit(pid, resource.RLIMIT_NOFILE, before)


@pytest.fixture
def running(service: Started, rig: str) -> Iterator[str]:
    """The id of a campaign whose test moves the rig, and another one waits."""
    begun = post(service.url, campaign_of(rig, LONG))["id"]
    resume(service.url, rig)
    until(service.url, begun, playing)
    yield begun
    httpx.post(f"{service.url}/v1/campaigns/{begun}/abort", timeout=30)
    until(service.url, begun, ended)


def served_again(service: Started) -> None:
    ends = time.monotonic() + 60
    while httpx.get(f"{service.url}/v1/rigs", timeout=30).status_code != 200:
        assert time.monotonic() < ends
        time.sleep(0.05)


def stopped(service: Started, campaign: str) -> tuple[httpx.Response, float]:
    """The answer to a stop, and the seconds that it took."""
    begun = time.monotonic()
    answer = httpx.post(f"{service.url}/v1/campaigns/{campaign}/stop", timeout=60)
    return answer, time.monotonic() - begun


def state_of(rig: str) -> RigState:
    with closing(connect(rig)) as wire:
        return wire.status(2.0).state


def test_a_service_with_too_few_descriptors_does_not_start_and_says_so_in_one_line(tmp_path: Path) -> None:
    done = subprocess.run(
        ["sh", "-c", 'ulimit -n 128 && exec "$@"', "sh", sys.executable, "-m", "api.cli", "serve", "--port", "0"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert done.returncode == 2
    [line] = done.stderr.splitlines()
    assert "128" in line
    assert "300" in line
    assert list(tmp_path.iterdir()) == []


def test_without_descriptors_others_are_refused_in_one_line_and_a_stop_reaches_the_rig(
    service: Started, rig: str, running: str
) -> None:
    address = ("127.0.0.1", int(service.url.rpartition(":")[2]))
    with no_more_descriptors(service.pid), ExitStack() as stack:
        for _ in range(40):  # those who say nothing, and those who look on for ever
            stack.enter_context(socket.create_connection(address, timeout=10))
            watcher = stack.enter_context(socket.create_connection(address, timeout=10))
            watcher.sendall(b"GET /v1/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        refused = httpx.post(f"{service.url}/v1/campaigns", json=campaign_of(rig, SHORT), timeout=30)
        assert refused.status_code == 503, refused.text
        assert "files open" in refused.json()["detail"]
        assert refused.headers["retry-after"]
        answer, took_s = stopped(service, running)
        assert (answer.status_code, answer.json()["acknowledged"]) == (202, True)
        assert answer.json()["by"] in BY
        assert took_s < 10.0
        for _ in range(4):  # it may be said as often as somebody likes
            again, more_s = stopped(service, running)
            assert again.status_code == 202
            took_s = min(took_s, more_s)
        assert took_s < 1.0  # the others may wait for a busy computer, not for descriptors
        ends = time.monotonic() + 60
        while state_of(rig) is not RigState.DISABLED:
            assert time.monotonic() < ends
            time.sleep(0.02)
    served_again(service)
    assert until(service.url, running, ended)["reason"] == "a stop was requested over HTTP"
    assert post(service.url, campaign_of(rig, SHORT))["state"] == "accepted"


@pytest.mark.slow
def test_without_descriptors_a_rig_whose_worker_was_killed_is_stopped_past_it(
    service: Started, rig: str, running: str
) -> None:
    worker = worker_of(service.url, rig)
    with no_more_descriptors(service.pid):
        os.kill(worker, signal.SIGKILL)
        answer = httpx.post(f"{service.url}/v1/campaigns/{running}/abort", timeout=30)
        assert (answer.status_code, answer.json()["acknowledged"], answer.json()["by"]) == (202, True, "service")
        assert state_of(rig) in (RigState.DISABLED, RigState.FAULT_DISABLED)
    served_again(service)
    assert until(service.url, running, ended)["state"] == "failed"
    until_rig(service.url, rig, lambda r: r["state"] in ("free", "latched fault"))


@pytest.mark.slow
def test_a_worker_without_descriptors_lets_campaigns_wait_and_goes_on_when_it_has_some(
    service: Started, rig: str
) -> None:
    until(service.url, post(service.url, campaign_of(rig, SHORT))["id"], ended)
    with no_more_descriptors(worker_of(service.url, rig)):
        waits = post(service.url, campaign_of(rig, SHORT))["id"]
        until_rig(service.url, rig, lambda r: r["paused"] is not None)
        assert get(service.url, f"/v1/campaigns/{waits}")["state"] == "accepted"
    until_rig(service.url, rig, lambda r: r["state"] == "free")
    resume(service.url, rig)
    assert until(service.url, waits, ended)["state"] == "done"


@pytest.mark.slow
def test_a_run_of_a_worker_without_descriptors_is_whole_and_a_stop_of_it_reaches_the_rig(
    service: Started, rig: str, running: str
) -> None:
    with no_more_descriptors(worker_of(service.url, rig)):
        answer = httpx.post(f"{service.url}/v1/campaigns/{running}/stop", timeout=30)
        assert (answer.status_code, answer.json()["by"] in BY) == (202, True)
        after = until(service.url, running, ended)
        assert state_of(rig) is RigState.DISABLED
        assert after["state"] in ("aborted", "failed")
        assert rig_of(service.url, rig)["paused"]
    [run] = reached(service.url, f"/v1/campaigns/{running}/runs", lambda answer: bool(answer["runs"]))["runs"]
    assert run["samples"] > 0
