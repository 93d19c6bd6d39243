"""A laboratory in processes of its own: simulated rig, its watcher, database, service; and its operator."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

import httpx

from api.processes.child import Child
from benchmarks.service_kills.database_server import DatabaseServer, free_port
from benchmarks.service_kills.watcher import Motions

__all__ = ["Laboratory", "NotThere", "waited"]

WITHIN_S = 180.0
WAITING = 8  # campaigns that wait at least
LEASE_S = "5"
TEST = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 2.0, "current": 0.5, "cycles": 3}
Answer = dict[str, Any]  # Any: JSON


class NotThere(Exception):
    """What was waited for did not come in time."""


def waited(what: str, is_there: Callable[[], Any], within_s: float = WITHIN_S) -> Any:
    """What ``is_there`` gives as soon as it is true. Any: whatever that is."""
    ends = time.monotonic() + within_s
    while True:
        with suppress(httpx.HTTPError):
            if found := is_there():
                return found
        if time.monotonic() > ends:
            raise NotThere(f"{what}: not within {within_s:g} s")
        time.sleep(0.02)


class Laboratory:
    """One rig and one service on one store. What was accepted stands in ``campaigns``, ``jobs`` and ``uploads``."""

    def __init__(self, folder: Path, server: DatabaseServer | None) -> None:
        self.folder, self.server = folder, server
        self.data, self.port = folder / "data", free_port()
        self.rig_url = f"modbus://127.0.0.1:{free_port()}"
        self.base = f"http://127.0.0.1:{self.port}"
        self.campaigns, self.jobs = list[str](), list[str]()
        self.uploads: dict[str, str] = {}
        self.motions = Motions(folder / "looks")
        self._children: dict[str, Child] = {}

    def __enter__(self) -> Self:
        """Start rig, watcher and service; all of them end where one does not start."""
        with ExitStack() as stack:
            stack.callback(self._end)
            self.start_rig()
            command = [sys.executable, "-m", "benchmarks.service_kills.watcher", self.rig_url, str(self.motions.file)]
            watcher = stack.enter_context(subprocess.Popen(command, stdin=subprocess.PIPE))
            stack.callback(watcher.kill)
            self.start_service()
            waited("a first look", self.motions.file.is_file)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _end(self) -> None:
        for child in reversed(self._children.values()):  # the service first: it leaves the rig at rest
            child.stop()

    @property
    def rig(self) -> Child:
        return self._children["rig"]

    @property
    def service(self) -> Child:
        return self._children["service"]

    def start_rig(self) -> None:
        self._children["rig"] = Child(["sim", "--listen", self.rig_url, "--seed", "3"], self.folder / "sim.log")
        self.rig.wait_until_ready(WITHIN_S)

    def start_service(self) -> None:
        environ = {**os.environ, "DAMPER_RIG_LEASE_S": LEASE_S}
        if self.server is not None:
            environ["DAMPER_RIG_DATABASE_URL"] = self.server.url
        command = ["serve", "--data", str(self.data), "--port", str(self.port)]
        self._children["service"] = Child(command, self.folder / "serve.log", environ=environ)
        self.service.wait_until_ready(WITHIN_S)

    def get(self, path: str) -> Answer:
        answer = httpx.get(self.base + path, timeout=30.0)
        answer.raise_for_status()
        found: Answer = answer.json()
        return found

    def submit(self, tests: int = 2) -> str:
        """Send a campaign until it is accepted, with one key: what came of it is known, whatever was killed."""
        named = [{"name": f"test {number}", **TEST} for number in range(tests)]
        body = {"name": f"campaign {len(self.campaigns)}", "rig": self.rig_url, "specimen": "7", "tests": named}
        key = {"Idempotency-Key": uuid4().hex}

        def accepted() -> Any:
            answer = httpx.post(f"{self.base}/v1/campaigns", json=body, headers=key, timeout=30.0)
            return answer if answer.status_code == 201 else None

        found = str(waited("a campaign is accepted", accepted).json()["id"])
        self.campaigns.append(found)
        return found

    def upload(self, content: bytes, sha256: str) -> None:
        """Send a run file once; only one that is accepted counts."""
        with suppress(httpx.HTTPError):
            answer = httpx.post(f"{self.base}/v1/runs", params={"name": "a.h5"}, content=content, timeout=60.0)
            if answer.status_code == 201:
                self.uploads[answer.json()["id"]] = sha256

    def state(self) -> Answer:
        """The rig as the service shows it."""
        [rig] = [rig for rig in self.get("/v1/rigs")["rigs"] if rig["url"] == self.rig_url]
        found: Answer = rig
        return found

    def fill(self) -> None:
        """Fill the queue."""
        waits = self.state()["accepted"] if self.campaigns else 0
        for _ in range(WAITING - waits):
            self.submit()

    def resume(self) -> None:
        """The word of the operator: what waits may start."""
        waited("the queue is resumed", lambda: self.post("/v1/rigs/resume", {"rig": self.rig_url}))

    def pause(self) -> None:
        """The other word of the operator: nothing more may start."""
        waited("the queue is paused", lambda: self.post(f"/v1/rigs/{self.state()['id']}/pause", {"reason": "enough"}))

    def attend(self) -> Answer | None:
        """What an operator does once: resume a queue that is paused, answer yes. The campaign that moves the rig."""
        rig = self.state()
        if rig["paused"] is not None and rig["running"] is None:
            self.resume()
        for one in self.get("/v1/campaigns?state=running")["campaigns"]:
            if one["question"]:
                self.post(f"/v1/campaigns/{one['id']}/confirm", {"answer": "yes"})
            if any(test["state"] == "running" and test["samples"] > 0 for test in one["tests"]):
                found: Answer = one
                return found
        return None

    def post(self, path: str, body: Answer) -> bool:
        return httpx.post(self.base + path, json=body, timeout=30.0).is_success
