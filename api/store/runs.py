"""Runs: their records and their files; only this module knows where files are kept."""

from __future__ import annotations

import asyncio
import hashlib
import re
from collections.abc import AsyncIterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from sqlalchemy import Connection, Row, Select, func, insert, select

from api.errors import DiskFull, Gone, InputError, NotFound
from api.processes.run_reader import RunReader, RunSummary
from api.settings import LEAST_FREE_BYTES, MOST_UPLOAD_BYTES_TOTAL, Settings
from api.store.campaign_numbers import campaign_number
from api.store.clock import now
from api.store.database import Database
from api.store.disk_space import DiskSpace, storage_errors
from api.store.part_file import PartFile, part_files, remove_part
from api.store.receiving import Receiving, uploaded_bytes
from api.store.samples import SampleStore
from api.store.tables import campaigns, rigs, runs, tests, uploads
from rigctl.canonical import canonical_address
from rigctl.runfile import read_run

__all__ = ["RunRecord", "RunStore", "Upload", "open_runs"]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.h5")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """The record of a captured run; the samples are only in the file."""

    id: str
    campaign_id: str
    test: str
    held_out: bool
    status: str
    location: str  # of the file, relative to the folder of run files
    size_bytes: int
    sha256: str
    samples: int
    sample_rate_hz: float
    created: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Upload:
    """The record of an uploaded run file."""

    id: str
    name: str
    location: str  # of the file, relative to the folder of run files
    size_bytes: int
    sha256: str
    specimen: str
    status: str
    samples: int
    sample_rate_hz: float
    test: str = ""


def open_runs(database: Database, settings: Settings) -> RunStore:
    """The runs of a service, for it and for its workers: with its limits."""
    return RunStore(
        database,
        settings.runs_dir.absolute(),
        least_free_bytes=settings.least_free_bytes,
        most_upload_bytes_total=settings.most_upload_bytes_total,
        most_bytes=settings.runs_quota_gb * 1e9,
    )


class RunStore:
    """Captured and uploaded runs: records in the database, files below one folder, a folder for each campaign."""

    def __init__(
        self,
        database: Database,
        root: Path,
        *,
        least_free_bytes: int = LEAST_FREE_BYTES,
        most_upload_bytes_total: int = MOST_UPLOAD_BYTES_TOTAL,
        most_bytes: float = float("inf"),
    ) -> None:
        """``most_bytes``: the quota of all run files."""
        self._database, self._root, self._most_bytes = database, root, most_bytes
        self._space = DiskSpace(folder=root, least_free_bytes=least_free_bytes)
        self._receiving = Receiving(database, self._space, most_upload_bytes_total)
        self._reader = RunReader()  # also for other files from elsewhere: one limit for all
        self.samples = SampleStore(database, root, self._receiving, self._reader)

    def total_bytes(self) -> int:
        """Size of all run files."""
        with self._database.reading() as connection:
            captured = select(func.sum(runs.c.size_bytes)).where(runs.c.removed_at_s.is_(None))
            return int(connection.scalar(captured) or 0) + uploaded_bytes(connection)

    def check_room(self) -> None:
        """Raise DiskFull where the disk is below its watermark or the run files have reached their quota.

        Then no test begins, and no campaign and no upload is accepted.
        """
        self._space.check()
        if self._most_bytes == float("inf"):
            return
        total = self.total_bytes()
        if total >= self._most_bytes:
            raise DiskFull(
                f"runs take {total / 1e9:.3g} GB of {self._most_bytes / 1e9:.3g} GB: remove some (DELETE /v1/runs/ID), "
                "or an administrator raises runs_quota_gb"
            )

    def work_dir(self, campaign_id: str) -> Path:
        """Where a worker captures the runs of a campaign."""
        return self._root / campaign_id

    def left_open(self, campaign_id: str = "*") -> frozenset[str]:
        """The ids of the campaigns with a run file that nobody closed, and that no live process writes."""
        return frozenset(part.parent.name for part in part_files(self._root, f"{campaign_id}/*.h5"))

    def without_folder(self, text: str) -> str:
        """A message as everybody may read it: it names run files, but not where they are kept."""
        return text.replace(f"{self._root}/", "")

    def describe(self, path: Path, *, campaign_id: str, held_out: bool) -> RunRecord:
        """The record of a closed run file in the folder of its campaign; raises RunFileError."""
        run = read_run(path)
        with path.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        return RunRecord(
            id=run.run_id,
            campaign_id=campaign_id,
            test=run.test_id,
            held_out=held_out,
            status=run.status,
            location=path.relative_to(self._root).as_posix(),
            size_bytes=path.stat().st_size,
            sha256=sha256,
            samples=run.samples,
            sample_rate_hz=run.sample_rate_hz,
            created=run.created,
        )

    def of_campaign(self, campaign_id: str) -> tuple[RunRecord, ...]:
        """The captured runs of a campaign in the order of its tests; raises NotFound."""
        with self._database.reading() as connection:
            number = campaign_number(connection, campaign_id)
            return _records(connection, _captured().where(runs.c.campaign == number))

    def one(self, campaign_id: str, run_id: str) -> RunRecord:
        """One captured run; raises NotFound."""
        found = [run for run in self.of_campaign(campaign_id) if run.id == run_id]
        if not found:
            raise NotFound(f"campaign {campaign_id} has no run {run_id!r:.60}")
        return found[0]

    def complete(self, *, campaign_id: str = "", rig: str = "", specimen: str = "") -> tuple[RunRecord, ...]:
        """Every complete run of a campaign, or of a rig and there of one specimen, in the order of campaigns and tests.

        Raises NotFound where there is no such campaign.
        """
        query = _captured().where(runs.c.status == "complete", runs.c.removed_at_s.is_(None))
        if rig:
            query = query.where(campaigns.c.rig_id.in_(_rigs_called(rig)))
        if specimen:
            query = query.where(campaigns.c.specimen == specimen)
        with self._database.reading() as connection:
            if campaign_id:
                query = query.where(runs.c.campaign == campaign_number(connection, campaign_id))
            return _records(connection, query)

    def paths(self, ids: Sequence[str]) -> tuple[Path, ...]:
        """The files of captured or uploaded runs by their ids, valid for one request or one job; raises NotFound."""
        with self._database.reading() as connection:
            locations = [_location(connection, run_id) for run_id in ids]
        return tuple(map(self._path, locations))

    def path(self, record: RunRecord) -> Path:
        """The file of one run, valid for one request or one job; raises NotFound where it is missing."""
        return self._path(record.location)

    def upload(self, upload_id: str) -> Upload:
        """One uploaded run; raises NotFound."""
        with self._database.reading() as connection:
            return _upload(connection, upload_id)

    def put_uploads_right(self) -> int:
        """Name or remove what a crash has left of uploads, except what another service is writing; returns how many."""
        parts = part_files(self._root / "uploads", "*/*")
        for part in parts:
            with self._database.reading() as connection:
                kept = connection.scalar(select(uploads.c.id).where(uploads.c.id == part.parent.name))
            if kept is None:
                remove_part(part)
            else:
                part.replace(part.with_suffix(""))
        return len(parts)

    async def receive(self, name: str, content: AsyncIterable[bytes], *, length: int = 0) -> Upload:
        """Store an uploaded run file: streamed to the disk, read in a process of its own, kept only where it is valid.

        ``length`` is what the sender has announced, 0 where it has not. Raises InputError for the name, TooLarge,
        TooSlow, DiskFull, Busy, and RunFileError with the message of the reader of run files.
        """
        if not _NAME.fullmatch(name):
            raise InputError(f"name is {name!a:.60}: give a name such as front-left_3.h5, of letters, digits, . _ -")
        with self._receiving.turn(name, length):
            return await self._receive(name, content, length)

    async def _receive(self, name: str, content: AsyncIterable[bytes], length: int) -> Upload:
        upload_id = uuid4().hex
        with storage_errors():
            await asyncio.to_thread(self._receiving.check_room, length)
            part = await asyncio.to_thread(PartFile, self._root / "uploads" / upload_id, name)
            try:
                await self._receiving.write(part, name, content)
                summary = await self._reader.read(part.path, name)
                return await asyncio.to_thread(self._keep, part, upload_id, summary)
            finally:
                part.discard()

    def _keep(self, part: PartFile, upload_id: str, summary: RunSummary) -> Upload:
        upload = Upload(
            id=upload_id,
            name=part.final.name,
            location=part.final.relative_to(self._root).as_posix(),
            size_bytes=part.size,
            sha256=part.sha256,
            **asdict(summary),
        )
        with self._database.writing() as connection:
            self._receiving.check_total(connection, part.size)
            connection.execute(insert(uploads).values(**asdict(upload), created_at_s=now()))
        part.name_it()
        return upload

    def remove_file(self, location: str) -> None:
        """Remove a run file; no error if there is none."""
        (self._root / location).unlink(missing_ok=True)

    def _path(self, location: str) -> Path:
        path = self._root / location
        if not path.is_file():
            raise NotFound(f"a run file is missing in the folder of run files: restore {location}")
        return path


def _rigs_called(text: str) -> Select[Any]:
    """The ids of the rigs with this address in any spelling, or this id, serial number or name."""
    if "://" in text:
        return select(rigs.c.id).where(rigs.c.address == canonical_address(text))
    return select(rigs.c.id).where((rigs.c.id == text) | (rigs.c.serial == text) | (rigs.c.name == text))


def _captured() -> Select[Any]:
    # Any: SQLAlchemy's rows know their columns only when they run
    its_test = (tests.c.campaign == runs.c.campaign) & (tests.c.name == runs.c.test)
    joined = select(runs, campaigns.c.id.label("campaign_id")).join(campaigns).outerjoin(tests, its_test)
    return joined.order_by(runs.c.campaign, tests.c.position, runs.c.created, runs.c.id)  # a clock may have been set


def _records(connection: Connection, query: Select[Any]) -> tuple[RunRecord, ...]:
    return tuple(RunRecord(**_values(RunRecord, row)) for row in connection.execute(query))


def _upload(connection: Connection, upload_id: str) -> Upload:
    row = connection.execute(select(uploads).where(uploads.c.id == upload_id)).one_or_none()
    if row is None:
        raise _unknown(upload_id)
    return Upload(**_values(Upload, row))


def _unknown(run_id: str) -> NotFound:
    return NotFound(f"there is no run {run_id!r:.60}: POST /v1/runs takes one, or give that of a campaign")


def _values(kind: type[RunRecord | Upload], row: Row[Any]) -> dict[str, Any]:
    return {name: getattr(row, name) for name in kind.__slots__}


def _location(connection: Connection, run_id: str) -> str:
    for table in (runs, uploads):
        row = connection.execute(
            select(table.c.location, table.c.removed_at_s).where(table.c.id == run_id)
        ).one_or_none()
        if row is not None and row.removed_at_s is not None:
            raise Gone(f"run {run_id} was removed: only its record is left")
        if row is not None:
            return str(row.location)
    raise _unknown(run_id)
