"""Jobs in the store, on SQLite and on PostgreSQL alike: one worker for each, every end written down as it was."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from api.errors import Conflict, LeaseLost, NotFound
from api.jobs.held_job import LEFT_OPEN, HeldJob, close_left_open, take_next
from api.jobs.records import Job, JobState
from api.jobs.results import Results, remove_old_results
from api.jobs.store import JobStore
from api.store.database import Database
from api.store.leases import holders

LEASE_S = 20.0
DAY_S = 86400.0
Seconds = Callable[[float], None]


@pytest.fixture
def jobs(database: Database) -> JobStore:
    return JobStore(database)


def accept(jobs: JobStore, kind: str = "explain", campaign: str = "") -> Job:
    return jobs.create(kind=kind, name="x", campaign_id=campaign, request={"runs": ["r1"], "held_out": []})


def taken(database: Database, owner: str = "me") -> HeldJob:
    held = take_next(database, owner, LEASE_S)
    assert held is not None
    return held


def test_an_accepted_job_reads_back_as_it_was_asked_for(jobs: JobStore) -> None:
    job = accept(jobs)
    assert jobs.one(job.id) == job
    assert (job.state, job.runs, job.held_out, job.has_files) == (JobState.ACCEPTED, ("r1",), (), False)


def test_jobs_of_every_kind_wait_in_one_queue_and_are_taken_in_the_order_of_acceptance(
    database: Database, jobs: JobStore
) -> None:
    asked = [accept(jobs, kind).id for kind in ("explain", "fit", "characterise")]
    assert [taken(database).job.id for _ in asked] == asked
    assert take_next(database, "me", LEASE_S) is None


def test_of_many_workers_each_takes_another_job(database: Database, jobs: JobStore) -> None:
    asked = {accept(jobs).id for _ in range(3)}
    with ThreadPoolExecutor(6) as pool:
        got = list(pool.map(lambda k: take_next(database, f"worker {k}", LEASE_S), range(6)))
    ids = [held.job.id for held in got if held is not None]
    assert len(ids) == len(set(ids))
    assert set(ids) <= asked
    rest = iter(lambda: take_next(database, "last", LEASE_S), None)
    assert {*ids, *(held.job.id for held in rest if held is not None)} == asked


def test_progress_is_written_down_and_answered_with_what_was_asked(database: Database, jobs: JobStore) -> None:
    job = accept(jobs)
    held = taken(database)
    assert held.progress("fitting", 0.5) is None
    assert (jobs.one(job.id).phase, jobs.one(job.id).done) == ("fitting", 0.5)
    assert jobs.cancel(job.id, "enough").state is JobState.RUNNING
    assert held.progress("fitting", 0.6) == "enough"
    held.end(JobState.CANCELLED, "enough")
    assert (jobs.one(job.id).state, jobs.one(job.id).reason) == (JobState.CANCELLED, "enough")
    assert jobs.cancel(job.id, "again").reason == "enough"


@pytest.mark.parametrize("state", [JobState.DONE, JobState.FAILED])
def test_an_accepted_cancellation_holds_where_the_work_came_to_its_end_first(
    database: Database, jobs: JobStore, state: JobState
) -> None:
    job = accept(jobs)
    held = taken(database)
    jobs.cancel(job.id, "enough")
    assert held.end(state, "too late", result={"verdict": "explained"}) is JobState.CANCELLED
    assert (jobs.one(job.id).state, jobs.one(job.id).reason) == (JobState.CANCELLED, "enough")
    assert not jobs.one(job.id).has_files


def test_a_job_that_waits_is_cancelled_at_once_and_one_that_has_ended_no_more(
    database: Database, jobs: JobStore
) -> None:
    waiting = accept(jobs)
    assert jobs.cancel(waiting.id, "enough").state is JobState.CANCELLED
    assert take_next(database, "me", LEASE_S) is None
    for state in (JobState.DONE, JobState.FAILED):
        job = accept(jobs)
        taken(database).end(state)
        with pytest.raises(Conflict, match=f"job {job.id} is {state}: it can no longer be cancelled"):
            jobs.cancel(job.id, "late")


def test_a_result_says_what_it_came_to(database: Database, jobs: JobStore) -> None:
    job = accept(jobs, "fit")
    taken(database).end(JobState.DONE, result={"gap_n": 1.5, "converged": True})
    done = jobs.one(job.id)
    assert (done.result, done.done, done.has_files) == ({"gap_n": 1.5, "converged": True}, 1.0, True)
    assert done.ended_at_s is not None
    with database.reading() as connection:
        assert holders(connection, database.sightings) == {}


def test_what_a_dead_worker_left_running_is_closed_and_the_dead_one_writes_nothing(
    database: Database, jobs: JobStore, pass_time: Seconds
) -> None:
    job = accept(jobs)
    dead = taken(database, "dead")
    close_left_open(database, "alive")
    assert jobs.one(job.id).state is JobState.RUNNING
    pass_time(LEASE_S + 1.0)
    close_left_open(database, "alive")
    closed = jobs.one(job.id)
    assert (closed.state, closed.reason) == (JobState.FAILED, LEFT_OPEN)
    for write in (lambda: dead.progress("x", 0.1), lambda: dead.end(JobState.DONE), dead.give_back):
        with pytest.raises(LeaseLost, match=job.id):
            write()
    assert jobs.one(job.id) == closed


def test_a_late_renewal_keeps_a_job_that_nobody_has_closed(
    database: Database, jobs: JobStore, pass_time: Seconds
) -> None:
    job = accept(jobs)
    late = taken(database)
    pass_time(LEASE_S + 1.0)
    late.progress("fitting", 0.5)
    close_left_open(database, "another")
    assert jobs.one(job.id).state is JobState.RUNNING


def test_what_is_given_back_is_taken_again(database: Database, jobs: JobStore) -> None:
    job = accept(jobs)
    held = taken(database)
    held.progress("fitting", 0.5)
    held.give_back()
    assert jobs.one(job.id) == job
    again = taken(database, "another").job
    assert again == replace(job, state=JobState.RUNNING, started_at_s=again.started_at_s)


def test_the_list_is_newest_first_in_pages_by_kind_and_by_campaign(jobs: JobStore) -> None:
    made = [accept(jobs, kind, campaign) for kind in ("explain", "fit") for campaign in ("", "c1")]
    page = jobs.newest(limit=3)
    assert [job.id for job in page] == [job.id for job in reversed(made)][:3]
    assert jobs.newest(limit=3, before=page[-1].number) == (made[0],)
    assert jobs.newest(kind="fit") == (made[3], made[2])
    assert jobs.newest(campaign_id="c1") == (made[3], made[1])


def test_a_view_of_one_kind_finds_no_other_and_names_its_own(database: Database, jobs: JobStore) -> None:
    fit, explanation = accept(jobs, "fit"), accept(jobs, "explain")
    explanations = JobStore(database, kind="explain", noun="explanation")
    assert explanations.newest() == (explanation,)
    with pytest.raises(NotFound, match=f"no explanation '{fit.id}': GET /v1/explanations lists them"):
        explanations.one(fit.id)
    with pytest.raises(NotFound):
        explanations.cancel(fit.id, "")
    with pytest.raises(NotFound, match="no job 'nobody': GET /v1/jobs lists them"):
        jobs.one("nobody")


def test_files_of_results_go_when_they_are_old_and_records_stay(
    database: Database, jobs: JobStore, pass_time: Seconds, tmp_path: Path
) -> None:
    results = Results(tmp_path / "results")
    old, failed = accept(jobs), accept(jobs)
    taken(database).end(JobState.DONE, result={"verdict": "explained"})
    taken(database).end(JobState.FAILED)
    pass_time(10 * DAY_S)
    new = accept(jobs)
    taken(database).end(JobState.DONE)
    for job in (old, new):
        results.folder(job.id).mkdir(parents=True)
        (results.folder(job.id) / "report.json").write_text("{}")
    assert remove_old_results(jobs, results, keep_s=11 * DAY_S) == 0
    assert remove_old_results(jobs, results, keep_s=float("inf")) == 0
    assert remove_old_results(jobs, results, keep_s=9 * DAY_S) == 1
    assert sorted(path.name for path in results.root.iterdir()) == [new.id]
    left = jobs.one(old.id)
    assert (left.state, left.result, left.has_files) == (JobState.DONE, {"verdict": "explained"}, False)
    assert jobs.one(new.id).has_files
    with pytest.raises(NotFound, match="submit it again"):
        results.file(left, "report.json")
    with pytest.raises(Conflict, match="failed: only one that is done has report"):
        results.file(jobs.one(failed.id), "report.json")
    assert remove_old_results(jobs, results, keep_s=9 * DAY_S) == 0
