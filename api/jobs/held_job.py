"""What a worker writes of the job that it runs: only under the lease of the job, so that no two run the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import String, literal, select

from api.jobs.records import Job, JobState
from api.jobs.store import end_job, job_resource, read_job, set_job
from api.store.clock import now
from api.store.database import Database
from api.store.leases import Lease, acquire, is_held, release, writing_as_holder
from api.store.tables import jobs

__all__ = ["LEFT_OPEN", "HeldJob", "close_left_open", "take_next"]

LEFT_OPEN = "the service that worked on it gave no sign of life in time: ask for it again"


def take_next(database: Database, owner: str, lease_s: float) -> HeldJob | None:
    """The job that has waited longest, now running in the hands of ``owner``; None where none waits."""
    waiting = select(jobs.c.id).where(jobs.c.state == JobState.ACCEPTED).order_by(jobs.c.number).limit(1)
    with database.reading() as connection:  # most often there is none, and readers wait for nobody
        if connection.scalar(waiting) is None:
            return None
    with database.writing() as connection:
        found = connection.scalar(waiting.with_for_update(skip_locked=True))
        if found is None:
            return None
        lease = acquire(connection, job_resource(found), owner, lease_s)
        if lease is None:
            return None
        set_job(connection, found, state=JobState.RUNNING, started_at_s=now())
        return HeldJob(database, read_job(connection, found), lease)


def close_left_open(database: Database, owner: str) -> None:
    """End as failed what runs in the store though the worker that ran it is dead."""
    resource = literal(job_resource(""), String) + jobs.c.id
    dead = select(jobs.c.id).where(jobs.c.state == JobState.RUNNING, ~is_held(resource))
    with database.reading() as connection:
        found = connection.scalars(dead).all()
    for job_id in found:
        with database.writing() as connection:
            lease = acquire(connection, job_resource(job_id), owner, 1.0)  # s: nobody waits for it
            if lease is None:  # it was alive after all
                continue
            if read_job(connection, job_id).state is JobState.RUNNING:
                end_job(connection, job_id, JobState.FAILED, LEFT_OPEN)
            release(connection, lease)


class HeldJob:
    """A job in the hands of the one worker that runs it.

    Every call renews its lease, and raises LeaseLost where another has taken it: nothing is written then.
    """

    def __init__(self, database: Database, job: Job, lease: Lease) -> None:
        self.job = job
        self.lease = lease
        self._database = database

    def progress(self, phase: str, done: float) -> str | None:
        """Write down how far it is; the reason where somebody has asked for its end."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_job(connection, self.job.id, phase=phase, done=done)
            return connection.scalar(select(jobs.c.cancel_reason).where(jobs.c.id == self.job.id))

    def end(self, state: JobState, reason: str = "", *, result: Mapping[str, Any] | None = None) -> None:
        """How it ended. Any: JSON."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_job(connection, self.job.id, result=dict(result or {}))
            end_job(connection, self.job.id, state, reason)
            release(connection, self.lease)

    def give_back(self) -> None:
        """Let another service, or this one when it is up again, begin it anew."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_job(connection, self.job.id, state=JobState.ACCEPTED, phase="", done=0.0, started_at_s=None)
            release(connection, self.lease)
