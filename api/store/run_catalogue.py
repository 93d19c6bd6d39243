"""All runs of the store, captured and uploaded: found by what they are, and removed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Connection, Row, Select, and_, func, or_, select, update

from api.errors import Conflict, Gone, NotFound
from api.store.clock import now
from api.store.database import Database
from api.store.tables import campaigns, jobs, runs, uploads

__all__ = ["AnyRun", "RunCatalogue", "RunFilter", "Specimen"]

_OPEN_JOBS = ("accepted", "running")


@dataclass(frozen=True, slots=True, kw_only=True)
class AnyRun:
    """The record of a captured or uploaded run; ``campaign_id`` and ``rig`` are empty for an uploaded one."""

    id: str
    campaign_id: str
    rig: str
    specimen: str
    test: str
    status: str
    held_out: bool
    samples: int
    sample_rate_hz: float
    size_bytes: int
    sha256: str
    location: str  # relative to the folder of run files
    created_at_s: float
    removed_at_s: float | None

    @property
    def key(self) -> tuple[float, str]:
        """The place in a list, which is the newest first."""
        return self.created_at_s, self.id


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFilter:
    """Which runs: empty or None means any."""

    rig: str = ""
    specimen: str = ""
    test: str = ""
    status: str = ""
    since_s: float | None = None
    until_s: float | None = None
    removed: bool = False  # those whose file was removed, too


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """A specimen and how many runs of it there are."""

    name: str
    runs: int
    size_bytes: int


class RunCatalogue:
    """Records of all runs. Safe to use from many threads."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def newest(self, chosen: RunFilter, *, limit: int, after: tuple[float, str] | None = None) -> tuple[AnyRun, ...]:
        """The newest first; ``after``: only those behind the run with this key."""
        with self._database.reading() as connection:
            found = [_captured(row) for row in connection.execute(_captured_query(chosen, after).limit(limit))]
            if not chosen.rig:
                found += [_uploaded(row) for row in connection.execute(_uploaded_query(chosen, after).limit(limit))]
        return tuple(sorted(found, key=lambda one: one.key, reverse=True)[:limit])

    def one(self, run_id: str) -> AnyRun:
        """One run, also one whose file was removed; raises NotFound."""
        with self._database.reading() as connection:
            return _one(connection, run_id)

    def present(self, run_id: str) -> AnyRun:
        """One run with its file; raises NotFound, and Gone where the file was removed."""
        run = self.one(run_id)
        if run.removed_at_s is not None:
            raise Gone(f"run {run_id} was removed: only its record is left")
        return run

    def remove(self, run_id: str) -> AnyRun:
        """Note that the file of a run is removed. Raises NotFound, Gone, and Conflict while a job uses the run."""
        with self._database.together() as connection:
            run = self.present(run_id)
            using = select(jobs.c.id, jobs.c.request).where(jobs.c.state.in_(_OPEN_JOBS))
            for job in connection.execute(using):
                if run_id in (*job.request.get("runs", ()), *job.request.get("held_out", ())):
                    raise Conflict(f"job {job.id} uses run {run_id}: cancel it or wait for its end")
            table = runs if run.campaign_id else uploads
            connection.execute(update(table).where(table.c.id == run_id).values(removed_at_s=now()))
            return run

    def specimens(self) -> tuple[Specimen, ...]:
        """Every specimen of which there are runs, by name."""
        sums: dict[str, tuple[int, int]] = {}
        with self._database.reading() as connection:
            for query in (
                select(campaigns.c.specimen, func.count(), func.sum(runs.c.size_bytes))
                .select_from(runs.join(campaigns))
                .where(runs.c.removed_at_s.is_(None))
                .group_by(campaigns.c.specimen),
                select(uploads.c.specimen, func.count(), func.sum(uploads.c.size_bytes))
                .where(uploads.c.removed_at_s.is_(None))
                .group_by(uploads.c.specimen),
            ):
                for name, count, size in connection.execute(query):
                    before = sums.get(name, (0, 0))
                    sums[name] = before[0] + int(count), before[1] + int(size)
        return tuple(Specimen(name=name, runs=n, size_bytes=size) for name, (n, size) in sorted(sums.items()))


def _captured_query(chosen: RunFilter, after: tuple[float, str] | None) -> Select[Any]:
    # Any, here and below: SQLAlchemy's rows know their columns only when they run
    query = select(
        *(runs.c[name] for name in runs.c.keys() if name != "campaign"),  # noqa: SIM118 - a collection of columns
        campaigns.c.id.label("campaign_id"),
        campaigns.c.rig,
        campaigns.c.specimen,
    ).join(campaigns)
    for column, value in (
        (campaigns.c.rig, chosen.rig),
        (campaigns.c.specimen, chosen.specimen),
        (runs.c.test, chosen.test),
        (runs.c.status, chosen.status),
    ):
        if value:
            query = query.where(column == value)
    if not chosen.removed:
        query = query.where(runs.c.removed_at_s.is_(None))
    if chosen.since_s is not None:
        query = query.where(runs.c.created >= _iso(chosen.since_s))
    if chosen.until_s is not None:
        query = query.where(runs.c.created < _iso(chosen.until_s))
    if after is not None:
        at = _iso(after[0])
        query = query.where(or_(runs.c.created < at, and_(runs.c.created == at, runs.c.id < after[1])))
    return query.order_by(runs.c.created.desc(), runs.c.id.desc())


def _uploaded_query(chosen: RunFilter, after: tuple[float, str] | None) -> Select[Any]:
    query = select(uploads)
    for column, value in (
        (uploads.c.specimen, chosen.specimen),
        (uploads.c.test, chosen.test),
        (uploads.c.status, chosen.status),
    ):
        if value:
            query = query.where(column == value)
    at = uploads.c.created_at_s
    if not chosen.removed:
        query = query.where(uploads.c.removed_at_s.is_(None))
    if chosen.since_s is not None:
        query = query.where(at >= chosen.since_s)
    if chosen.until_s is not None:
        query = query.where(at < chosen.until_s)
    if after is not None:
        query = query.where(or_(at < after[0], and_(at == after[0], uploads.c.id < after[1])))
    return query.order_by(at.desc(), uploads.c.id.desc())


def _one(connection: Connection, run_id: str) -> AnyRun:
    any_of = RunFilter(removed=True)
    row = connection.execute(_captured_query(any_of, None).where(runs.c.id == run_id)).one_or_none()
    if row is not None:
        return _captured(row)
    row = connection.execute(_uploaded_query(any_of, None).where(uploads.c.id == run_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no run {run_id!r:.60}: GET /v1/runs lists them")
    return _uploaded(row)


def _captured(row: Row[Any]) -> AnyRun:
    values = {name: getattr(row, name) for name in _same(("held_out", "campaign_id", "rig"))}
    return AnyRun(**values, created_at_s=datetime.fromisoformat(row.created).timestamp())


def _uploaded(row: Row[Any]) -> AnyRun:
    values = {name: getattr(row, name) for name in _same(("created_at_s",))}
    return AnyRun(**values, held_out=False, campaign_id="", rig="")


def _same(more: Iterable[str]) -> tuple[str, ...]:
    both = ("id", "specimen", "test", "status", "samples", "sample_rate_hz", "size_bytes", "sha256")
    return (*both, "location", "removed_at_s", *more)


def _iso(seconds: float) -> str:
    """The time as run files have it, whose text sorts as the time does."""
    return datetime.fromtimestamp(seconds, UTC).isoformat()
