"""One kill: the rig plays, a part dies, and it is timed and counted what the service says and what the rig does."""

from __future__ import annotations

import hashlib
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

import httpx
import numpy as np

from benchmarks.service_kills.checks import Found, busy, cancel_jobs, look
from benchmarks.service_kills.laboratory import Laboratory, NotThere, waited

__all__ = ["KINDS", "Outcome", "kill_one", "prepare"]

KINDS = ("service", "worker", "rig", "explanation", "database", "between file and row")
PAUSES = ("service", "worker", "rig", "between file and row")  # after these nothing may start until somebody resumes
DOWN_S = 2.0  # for which the database stays away
SETTLE_S = 4.0  # longer than any campaign was seen to start by itself (1.4 … 2.6 s)
MODEL = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "as simulated",
    "kind": "physical",
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 1500.0}}]},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What one kill led to. ``rest_s``: until the rig was last seen under power after a kill that pauses."""

    kind: str
    unasked: int
    told_s: float
    rest_s: float
    found: Found


def prepare(lab: Laboratory) -> str:
    """Play one campaign to its end; returns its id: its runs are what is explained and uploaded."""
    for _ in range(5):  # on a busy computer a stream may run dry
        campaign = lab.submit(tests=2)

        def ended(campaign: str = campaign) -> str | None:
            lab.attend()
            answer = lab.get(f"/v1/campaigns/{campaign}")
            return str(answer["state"]) if answer["ended"] else None

        if waited("the first campaign is played", ended) == "done":
            return campaign
    raise NotThere("no campaign was played to its end, five times")


def kill_one(lab: Laboratory, kind: str, explained: str, random: np.random.Generator) -> Outcome:
    """Kill one part while the rig moves and the queue is full; afterwards the laboratory is whole and nothing runs."""
    waited("the queue is full", lambda: lab.fill() or True)
    if kind == "explanation" or random.uniform() < 0.3:
        _explain(lab, explained)
    lab.resume()
    playing = waited("a test plays", lab.attend)
    strike = _strike(lab, kind, playing)
    time.sleep(0.0 if kind == "between file and row" else random.uniform(0.0, 1.5))
    others = [Thread(target=lab.submit, daemon=True), Thread(target=_upload, args=(lab, explained), daemon=True)]
    for thread in others:
        thread.start()
    killed_at, told_s = strike()
    for thread in others:
        thread.join()
    return _afterwards(lab, kind, killed_at, told_s)


def _afterwards(lab: Laboratory, kind: str, killed_at: float, told_s: float) -> Outcome:
    """Wait until nothing runs, and count. An operator pauses a queue that goes on of itself as it may."""
    if kind not in PAUSES and waited("the rig is shown", lab.state)["paused"] is None:
        lab.pause()
    waited("the jobs are cancelled", lambda: cancel_jobs(lab))
    waited("nothing runs", lambda: not busy(lab))
    forbidden_from = killed_at if kind in PAUSES else time.time()
    time.sleep(SETTLE_S)
    unasked = lab.motions.between(forbidden_from, time.time())
    rest_s = max(0.0, lab.motions.last_powered_at - killed_at) if kind in PAUSES else 0.0
    return Outcome(kind=kind, unasked=unasked, told_s=told_s, rest_s=rest_s, found=look(lab))


def _strike(lab: Laboratory, kind: str, playing: dict[str, Any]) -> Callable[[], tuple[float, float]]:
    """What kills, waits until the service tells it, and repairs: the moment of the kill, and the time until told."""
    worker = int(lab.state()["worker"].split(":")[1])

    def pause_is_told() -> bool:
        return lab.state()["paused"] is not None

    def service() -> tuple[float, float]:
        killed_at = time.time()
        lab.service.kill()
        lab.start_service()
        return killed_at, _until(pause_is_told, killed_at)

    def kill_worker() -> tuple[float, float]:
        killed_at = _kill(worker)
        return killed_at, _until(pause_is_told, killed_at)

    def between() -> tuple[float, float]:
        _wait_for_a_file(lab.data / "runs" / playing["id"])
        return kill_worker()

    def rig() -> tuple[float, float]:
        killed_at = time.time()
        lab.rig.kill()
        told_s = _until(pause_is_told, killed_at)
        lab.start_rig()
        return killed_at, told_s

    def explanation() -> tuple[float, float]:
        killed_at = _kill(_job_process(lab))
        job = f"/v1/jobs/{lab.jobs[-1]}"
        return killed_at, _until(lambda: lab.get(job)["state"] == "failed", killed_at)

    def database() -> tuple[float, float]:
        assert lab.server is not None
        killed_at = time.time()
        lab.server.kill()
        told_s = _until(lambda: httpx.get(f"{lab.base}/v1/health/ready", timeout=30.0).status_code == 503, killed_at)
        time.sleep(DOWN_S)
        lab.server.start()
        waited("the store is back", lambda: httpx.get(f"{lab.base}/v1/health/ready", timeout=30.0).status_code == 200)
        return killed_at, told_s

    ways = {"service": service, "worker": kill_worker, "between file and row": between, "rig": rig}
    return {**ways, "explanation": explanation, "database": database}[kind]


def _kill(pid: int) -> float:
    os.kill(pid, signal.SIGKILL)
    return time.time()


def _until(told: Callable[[], bool], since: float) -> float:
    waited("the service tells it", told)
    return time.time() - since


def _explain(lab: Laboratory, campaign: str) -> None:
    """Start an explanation, and wait until its process works."""
    body = {"kind": "explain", "campaign": campaign, "model": MODEL}

    def accepted() -> Any:  # on a busy computer its check may take too long, and is refused
        answer = httpx.post(f"{lab.base}/v1/jobs", json=body, timeout=180.0)
        return answer if answer.status_code == 201 else print("explanation:", answer.text)

    job = waited("an explanation is accepted", accepted, 600.0).json()["id"]
    lab.jobs.append(job)
    waited("the explanation runs", lambda: lab.get(f"/v1/jobs/{job}")["state"] != "accepted")


def _job_process(lab: Laboratory) -> int:
    """The process of the job that runs."""

    def found() -> int | None:
        for task in Path(f"/proc/{lab.service.pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                with suppress(OSError):
                    if b"api.jobs" in Path(f"/proc/{child}/cmdline").read_bytes():
                        return int(child)
        return None

    return int(waited("the process of the explanation", found))


def _wait_for_a_file(folder: Path) -> None:
    """Return at the moment at which a run of this campaign gets its name: its row comes after it."""
    before = set(folder.glob("*.h5"))
    waited_until = time.monotonic() + 60.0
    while set(folder.glob("*.h5")) == before:
        if time.monotonic() > waited_until:
            return
        time.sleep(0.001)


def _upload(lab: Laboratory, campaign: str) -> None:
    content = next((lab.data / "runs" / campaign).glob("*.h5")).read_bytes()
    lab.upload(content, hashlib.sha256(content).hexdigest())
