"""What is looked at after every kill: what was accepted is there, nothing is left open, no temporary file is left."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from benchmarks.service_kills.laboratory import Laboratory

__all__ = ["Found", "busy", "cancel_jobs", "look"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Counts of what must not be, with a line for each."""

    lost: int
    left_open: int
    temporary: int
    lines: tuple[str, ...]


def busy(lab: Laboratory) -> bool:
    """Whether a campaign or a job runs, or is shown as running."""
    running = lab.get("/v1/campaigns?state=running")["campaigns"]
    return bool(running) or any(job["state"] == "running" for job in lab.get("/v1/jobs")["jobs"])


def cancel_jobs(lab: Laboratory) -> bool:
    """Ask every job that runs to end: an explanation of its own accord takes minutes on a busy computer."""
    for job in lab.get("/v1/jobs")["jobs"]:
        if job["state"] in ("running", "accepted"):
            lab.post(f"/v1/jobs/{job['id']}/cancel", {})
    return True


def look(lab: Laboratory, *, everything: bool = False) -> Found:
    """Call it while nothing runs; ``everything``: also what was accepted long ago."""
    newest = slice(None) if everything else slice(-30, None)
    lost: list[str] = []
    left_open: list[str] = []
    for one in lab.campaigns[newest]:
        _campaign(lab, one, lost, left_open)
    for job in lab.jobs[newest]:
        answer = httpx.get(f"{lab.base}/v1/jobs/{job}", timeout=30.0)
        if answer.status_code != 200:
            lost.append(f"job {job}: {answer.status_code}")
        elif answer.json()["state"] == "running":
            left_open.append(f"job {job} runs")
    for upload, sha256 in list(lab.uploads.items())[newest]:
        answer = httpx.get(f"{lab.base}/v1/runs/{upload}/file", timeout=60.0)
        if answer.status_code != 200 or hashlib.sha256(answer.content).hexdigest() != sha256:
            lost.append(f"upload {upload}: {answer.status_code}")
    temporary = [f"left: {path.relative_to(lab.data)}" for path in lab.data.rglob("*") if _is_temporary(path)]
    temporary += _results_without_a_job(lab)
    return Found(
        lost=len(lost),
        left_open=len(left_open),
        temporary=len(temporary),
        lines=(*lost, *left_open, *temporary),
    )


def _campaign(lab: Laboratory, one: str, lost: list[str], left_open: list[str]) -> None:
    answer = httpx.get(f"{lab.base}/v1/campaigns/{one}", timeout=30.0)
    if answer.status_code != 200:
        lost.append(f"campaign {one}: {answer.status_code}")
        return
    campaign = answer.json()
    open_tests = [test["name"] for test in campaign["tests"] if test["state"] == "running"]
    if campaign["state"] == "running" or open_tests:
        left_open.append(f"campaign {one} is {campaign['state']}, running tests {open_tests}")
    runs = lab.get(f"/v1/campaigns/{one}/runs")["runs"]
    recorded = {run["test"] for run in runs}
    lost += [
        f"campaign {one}: test {test['name']} is done without a run"
        for test in campaign["tests"]
        if test["state"] == "done" and test["name"] not in recorded
    ]
    folder = lab.data / "runs" / one
    files = {digest(path) for path in folder.glob("*.h5")} if folder.is_dir() else set()
    stored = {run["sha256"] for run in runs}
    if files != stored:
        lost.append(
            f"campaign {one}: {len(files - stored)} files without a row, {len(stored - files)} rows without one"
        )


def digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_temporary(path: Path) -> bool:
    return path.is_file() and (path.suffix in (".part", ".tmp") or path.name.startswith("."))


def _results_without_a_job(lab: Laboratory) -> list[str]:
    """Folders of results whose job is not done."""
    states: dict[str, Any] = {job["id"]: job["state"] for job in lab.get("/v1/jobs?limit=200")["jobs"]}
    folder = lab.data / "reports"
    kept = folder.iterdir() if folder.is_dir() else ()
    return [f"left: reports/{one.name}, its job is {states.get(one.name)}" for one in kept
            if states.get(one.name) != "done"]  # fmt: skip
