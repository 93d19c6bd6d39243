"""Writes of the worker of a job, only under the lease of the job, so that no two workers run one job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import select

from api.jobs.records import Job, JobState
from api.jobs.store import end_job, job_resource, read_job, set_job
from api.store.clock import now
from api.store.database import Database
from api.store.leases import Lease, acquire, holders, release, writing_as_holder
from api.store.tables import jobs

__all__ = ["LEFT_OPEN", "HeldJob", "close_left_open", "take_next"]

LEFT_OPEN = "the service that ran it did not renew its lease in time: submit it again"


def take_next(database: Database, owner: str, lease_s: float) -> HeldJob | None:
    """The job that has waited longest, now held by ``owner`` and running; None where none waits."""
    waiting = select(jobs.c.id).where(jobs.c.state == JobState.ACCEPTED).order_by(jobs.c.number).limit(1)
    with database.reading() as connection:  # most often there is none, and a reader does not wait for a lock
        if connection.scalar(waiting) is None:
            return None
    with database.writing() as connection:
        found = connection.scalar(waiting.with_for_update(skip_locked=True))
        if found is None:
            return None
        lease = acquire(connection, database.sightings, job_resource(found), owner, lease_s)
        if lease is None:
            return None
        set_job(connection, found, state=JobState.RUNNING, started_at_s=now())
        return HeldJob(database, read_job(connection, found), lease)


def close_left_open(database: Database, owner: str) -> int:
    """End the jobs as failed that the store has as running although their worker has died; returns how many."""
    with database.reading() as connection:
        running = connection.scalars(select(jobs.c.id).where(jobs.c.state == JobState.RUNNING)).all()
        held = holders(connection, database.sightings) if running else {}
    found = [job_id for job_id in running if job_resource(job_id) not in held]
    for job_id in found:
        with database.writing() as connection:
            lease = acquire(
                connection, database.sightings, job_resource(job_id), owner, 1.0
            )  # s: only for this transaction
            if lease is None:  # its worker is alive
                continue
            if read_job(connection, job_id).state is JobState.RUNNING:
                end_job(connection, job_id, JobState.FAILED, LEFT_OPEN)
            release(connection, lease)
    return len(found)


class HeldJob:
    """A job, for the one worker that runs it.

    Every call renews its lease. It raises LeaseLost, and writes nothing, where another worker has taken the job.
    """

    def __init__(self, database: Database, job: Job, lease: Lease) -> None:
        self.job = job
        self.lease = lease
        self._database = database

    def progress(self, phase: str, done: float) -> str | None:
        """Store the progress; returns the reason where a cancellation was requested."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_job(connection, self.job.id, phase=phase, done=done)
            return connection.scalar(select(jobs.c.cancel_reason).where(jobs.c.id == self.job.id))

    def end(self, state: JobState, reason: str = "", *, result: Mapping[str, Any] | None = None) -> JobState:
        """Store how it ended, and return it: cancelled, whatever came of it, where a cancellation was accepted before.

        Any: JSON.
        """
        with writing_as_holder(self._database, self.lease) as connection:
            asked = connection.scalar(select(jobs.c.cancel_reason).where(jobs.c.id == self.job.id).with_for_update())
            if asked is not None:
                state, reason, result = JobState.CANCELLED, asked, None
            set_job(connection, self.job.id, result=dict(result or {}))
            end_job(connection, self.job.id, state, reason)
            release(connection, self.lease)
        return state

    def give_back(self) -> None:
        """Return it to the queue, so that this service or another starts it again."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_job(connection, self.job.id, state=JobState.ACCEPTED, phase="", done=0.0, started_at_s=None)
            release(connection, self.lease)
