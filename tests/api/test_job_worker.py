"""The worker that runs jobs, with a store and without a service around it."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from api.jobs.held_job import take_next
from api.jobs.process import JobProcess
from api.jobs.records import Job, JobState
from api.jobs.results import Results, put_results_right
from api.jobs.store import JobStore
from api.jobs.worker import JobWorker
from api.settings import Settings
from api.store.database import Database
from api.store.part_file import PartMark
from api.store.runs import RunStore
from rigctl.runfile import write_run
from tests.api.measured import MODEL, a_run


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


def test_what_kill_9_leaves_of_a_result_is_removed_and_what_is_being_written_is_left_alone(
    database: Database, results: Results
) -> None:
    jobs = JobStore(database)
    written, whole, broken = (accept(jobs, "fit") for _ in range(3))
    marks = {job.id: results.begin(job.id) for job in (written, whole, broken)}
    for job in (written, whole, broken):
        (results.folder(job.id) / ".report.html.7.tmp").touch()
    while (held := take_next(database, "dead", 20.0)) is not None:
        if held.job.id == whole.id:
            held.end(JobState.DONE)
    for job in (whole, broken):
        left_as_a_crash_does(marks[job.id])
    assert put_results_right(jobs, results) == 2
    assert sorted(path.name for path in results.root.iterdir()) == sorted([written.id, f"{written.id}.part", whole.id])
    marks[written.id].end(keep=True)
    assert sorted(path.name for path in results.root.iterdir()) == sorted([written.id, whole.id])


def left_as_a_crash_does(mark: PartMark) -> None:
    mark._file.close()


def test_the_process_of_a_job_keeps_its_result_marked_after_its_service_was_killed(
    database: Database, results: Results, tmp_path: Path
) -> None:
    jobs = JobStore(database)
    job = accept(jobs, "fit")
    write_run(tmp_path / "run.h5", a_run(1, 2.0))
    mark = results.begin(job.id)
    request = {"model": MODEL, "runs": ["x"], "held_out": []}
    folder = results.folder(job.id)
    with JobProcess("fit", request, [tmp_path / "run.h5"], [], folder=folder, part=mark.handle) as process:
        os.kill(process.pid, signal.SIGSTOP)
        left_as_a_crash_does(mark)
        assert put_results_right(jobs, results) == 0
        os.kill(process.pid, signal.SIGKILL)
        assert process.ended(60.0)
    assert put_results_right(jobs, results) == 1
    assert list(results.root.iterdir()) == []


def test_a_job_leaves_no_mark_behind_however_it_ends(database: Database, worker: JobWorker, results: Results) -> None:
    jobs = JobStore(database)
    job = accept(jobs, "characterise")
    worker.start()
    assert ended(jobs, job).state is JobState.FAILED
    until(lambda: list(results.root.iterdir()) == [])
