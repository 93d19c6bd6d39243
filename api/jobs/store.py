"""Jobs in the store: accepted, listed, cancelled. The writes of a worker are in ``held_job``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from uuid import uuid4

from sqlalchemy import Connection, Row, Select, insert, select, update

from api.errors import Conflict, NotFound
from api.jobs.records import Job, JobState
from api.store.clock import now
from api.store.database import Database
from api.store.tables import jobs

__all__ = ["JobStore", "end_job", "job_resource", "read_job", "set_job"]


class JobStore:
    """Jobs in the database, of one ``kind`` where it is given; ``noun`` is what messages call one of them.

    Safe to use from many threads; every call is one transaction.
    """

    def __init__(self, database: Database, *, kind: str = "", noun: str = "job") -> None:
        self._database, self._kind, self._noun = database, kind, noun

    def create(self, *, kind: str, name: str, campaign_id: str, request: Mapping[str, Any]) -> Job:
        """Store a new job. Any: JSON."""
        row = insert(jobs).values(
            id=uuid4().hex,
            kind=kind,
            name=name,
            campaign=campaign_id or None,
            request=dict(request),
            result={},
            state=JobState.ACCEPTED,
            phase="",
            done=0.0,
            reason="",
            created_at_s=now(),
        )
        with self._database.writing() as connection:
            return read_job(connection, connection.scalars(row.returning(jobs.c.id)).one())

    def one(self, job_id: str) -> Job:
        """One job; raises NotFound."""
        with self._database.reading() as connection:
            return self._read(connection, job_id, self._query())

    def newest(
        self, *, limit: int = 50, before: int | None = None, campaign_id: str = "", kind: str = ""
    ) -> tuple[Job, ...]:
        """The newest first; ``before``: only those accepted before that number."""
        query = self._query().order_by(jobs.c.number.desc()).limit(limit)
        if before is not None:
            query = query.where(jobs.c.number < before)
        for column, value in ((jobs.c.campaign, campaign_id), (jobs.c.kind, kind)):
            if value:
                query = query.where(column == value)
        with self._database.reading() as connection:
            return tuple(_job(row) for row in connection.execute(query))

    def cancel(self, job_id: str, reason: str) -> Job:
        """Cancel a job: at once where it waits, by its worker where it runs.

        Raises NotFound, and Conflict where it has ended in another way.
        """
        with self._database.writing() as connection:
            job = self._read(connection, job_id, self._query().with_for_update())
            match job.state:
                case JobState.ACCEPTED:
                    end_job(connection, job_id, JobState.CANCELLED, reason)
                case JobState.RUNNING:
                    set_job(connection, job_id, cancel_reason=reason)
                case JobState.DONE | JobState.FAILED:
                    raise Conflict(f"{self._noun} {job_id} is {job.state}: it can no longer be cancelled")
            return read_job(connection, job_id)

    def with_files_older_than(self, age_s: float) -> tuple[str, ...]:
        """Ids of the jobs that ended longer ago than ``age_s`` and still have their files."""
        old = (jobs.c.state == JobState.DONE) & jobs.c.removed_at_s.is_(None) & (jobs.c.ended_at_s < now() - age_s)
        with self._database.reading() as connection:
            return tuple(connection.scalars(select(jobs.c.id).where(old).order_by(jobs.c.number)))

    def files_removed(self, job_id: str) -> None:
        """Store that the files of its result were removed."""
        with self._database.writing() as connection:
            set_job(connection, job_id, removed_at_s=now())

    def _query(self) -> Select[Any]:
        return select(jobs).where(jobs.c.kind == self._kind) if self._kind else select(jobs)

    def _read(self, connection: Connection, job_id: str, query: Select[Any]) -> Job:
        row = connection.execute(query.where(jobs.c.id == job_id)).one_or_none()
        if row is None:
            raise NotFound(f"there is no {self._noun} {job_id!r:.60}: GET /v1/{self._noun}s lists them")
        return _job(row)


def job_resource(job_id: str) -> str:
    """The resource of a lease on a job."""
    return f"job {job_id}"


def read_job(connection: Connection, job_id: str) -> Job:
    """The job with an id that exists."""
    return _job(connection.execute(select(jobs).where(jobs.c.id == job_id)).one())


def set_job(connection: Connection, job_id: str, **values: object) -> None:
    """Write columns of a job."""
    connection.execute(update(jobs).where(jobs.c.id == job_id).values(**values))


def end_job(connection: Connection, job_id: str, state: JobState, reason: str) -> None:
    """End a job."""
    done = {"done": 1.0} if state is JobState.DONE else {}
    set_job(connection, job_id, state=state, reason=reason, phase="", ended_at_s=now(), **done)


def _job(row: Row[Any]) -> Job:
    # Any: SQLAlchemy's rows know their columns only when they run
    return Job(
        number=row.number,
        id=row.id,
        kind=row.kind,
        name=row.name,
        campaign_id=row.campaign or "",
        request=row.request,
        result=row.result,
        state=JobState(row.state),
        phase=row.phase,
        done=row.done,
        reason=row.reason,
        created_at_s=row.created_at_s,
        started_at_s=row.started_at_s,
        ended_at_s=row.ended_at_s,
        removed_at_s=row.removed_at_s,
    )
