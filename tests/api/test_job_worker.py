"""The worker that runs jobs, with a store and without a service around it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from api.jobs.held_job import take_next
from api.jobs.records import Job, JobState
from api.jobs.results import Results
from api.jobs.store import JobStore
from api.jobs.worker import JobWorker
from api.settings import Settings
from api.store.database import Database
from api.store.runs import RunStore


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with Database(f"sqlite:///{tmp_path / 'jobs.db'}") as opened:
        yield opened


@pytest.fixture
def results(tmp_path: Path) -> Results:
    return Results(tmp_path / "results")


@pytest.fixture
def worker(database: Database, results: Results, tmp_path: Path) -> Iterator[JobWorker]:
    """A worker that has not been started."""
    settings = Settings(data_dir=tmp_path, poll_s=0.02, keep_results_days=30.0)
    made = JobWorker(database, RunStore(database, tmp_path / "runs"), results, settings)
    yield made
    made.stop()


def until(true: Callable[[], bool], within_s: float = 60.0) -> None:
    ends = time.monotonic() + within_s
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.01)


def accept(jobs: JobStore, kind: str, *runs: str) -> Job:
    return jobs.create(kind=kind, name="x", campaign_id="", request={"runs": list(runs), "held_out": []})


def ended(jobs: JobStore, job: Job) -> Job:
    until(lambda: jobs.one(job.id).ended_at_s is not None)
    return jobs.one(job.id)


def test_a_job_that_cannot_be_run_fails_in_words_and_the_next_one_is_run(database: Database, worker: JobWorker) -> None:
    jobs = JobStore(database)
    asked = [accept(jobs, "explain", "nobody"), accept(jobs, "of a later version"), accept(jobs, "characterise")]
    worker.start()
    found = [ended(jobs, job) for job in asked]
    assert [job.state for job in found] == [JobState.FAILED] * 3
    assert "nobody" in found[0].reason
    assert "kind is 'of a later version': this version has explain" in found[1].reason
    assert "no steady sine" in found[2].reason
    assert all("\n" not in job.reason for job in found)


def test_results_are_removed_when_they_are_older_than_the_setting_says(
    database: Database, worker: JobWorker, results: Results, pass_time: Callable[[float], None]
) -> None:
    jobs = JobStore(database)
    job = accept(jobs, "fit")
    held = take_next(database, "another", 20.0)
    assert held is not None
    held.end(JobState.DONE, result={"gap_n": 1.0})
    results.folder(job.id).mkdir(parents=True)
    pass_time(31 * 86400.0)
    worker.start()
    until(lambda: not jobs.one(job.id).has_files)
    assert not results.folder(job.id).exists()
    assert jobs.one(job.id).result == {"gap_n": 1.0}
