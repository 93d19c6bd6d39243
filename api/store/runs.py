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

from sqlalchemy import Connection, Row, Select, insert, select

from api.errors import InputError, NotFound, TooLarge
from api.store.campaign_numbers import campaign_number
from api.store.clock import now
from api.store.database import Database
from api.store.tables import campaigns, runs, uploads
from rigctl.errors import RunFileError
from rigctl.runfile import Run, read_run

__all__ = ["RunRecord", "RunStore", "Upload"]

MOST_BYTES = 512 * 2**20  # of an uploaded file
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


class RunStore:
    """Captured and uploaded runs: records in the database, files below one folder, a folder for each campaign."""

    def __init__(self, database: Database, root: Path) -> None:
        self._database, self._root = database, root

    def work_dir(self, campaign_id: str) -> Path:
        """Where a worker captures the runs of a campaign."""
        return self._root / campaign_id

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
        """The captured runs of a campaign in the order of capture; raises NotFound."""
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
        """Every complete run of a campaign, or of a rig and there of one specimen, in the order of capture.

        Raises NotFound where there is no such campaign.
        """
        query = _captured().where(runs.c.status == "complete")
        for column, value in ((campaigns.c.rig, rig), (campaigns.c.specimen, specimen)):
            if value:
                query = query.where(column == value)
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

    async def receive(self, name: str, content: AsyncIterable[bytes]) -> Upload:
        """Store an uploaded run file: streamed to the disk, read whole, and kept only where it is valid.

        Raises InputError for its name, TooLarge, and RunFileError with the message of the reader of run files.
        """
        if not _NAME.fullmatch(name):
            raise InputError(f"name is {name!a:.60}: give a name such as front-left_3.h5, of letters, digits, . _ -")
        upload_id = uuid4().hex
        folder = self._root / "uploads" / upload_id
        path = folder / name
        await asyncio.to_thread(folder.mkdir, parents=True)
        try:
            size, sha256 = await _write(path, content)
            return await asyncio.to_thread(self._keep, path, upload_id, size, sha256)
        except BaseException:
            path.unlink(missing_ok=True)
            folder.rmdir()
            raise

    def _keep(self, path: Path, upload_id: str, size: int, sha256: str) -> Upload:
        run = _read_upload(path)
        upload = Upload(
            id=upload_id,
            name=path.name,
            location=path.relative_to(self._root).as_posix(),
            size_bytes=size,
            sha256=sha256,
            specimen=run.specimen,
            status=run.status,
            samples=run.samples,
            sample_rate_hz=run.sample_rate_hz,
        )
        with self._database.writing() as connection:
            connection.execute(insert(uploads).values(**asdict(upload), created_at_s=now()))
        return upload

    def _path(self, location: str) -> Path:
        path = self._root / location
        if not path.is_file():
            raise NotFound(f"a run file is missing in the folder of run files: restore {location}")
        return path


async def _write(path: Path, content: AsyncIterable[bytes]) -> tuple[int, str]:
    """Write the uploaded bytes; returns their number and their SHA-256."""
    size, digest = 0, hashlib.sha256()
    with path.open("wb") as file:
        async for part in content:
            size += len(part)
            if size > MOST_BYTES:
                raise TooLarge(f"{path.name} is larger than {MOST_BYTES} bytes: divide the run into several")
            digest.update(part)
            await asyncio.to_thread(file.write, part)
    return size, digest.hexdigest()


def _read_upload(path: Path) -> Run:
    try:
        return read_run(path)
    except RunFileError as error:  # the sender knows the name of the file, not our folders
        raise RunFileError(str(error).replace(f"{path.parent}/", "")) from error


def _captured() -> Select[Any]:
    # Any: SQLAlchemy's rows know their columns only when they run
    joined = select(runs, campaigns.c.id.label("campaign_id")).join(campaigns)
    return joined.order_by(runs.c.created, runs.c.id)


def _records(connection: Connection, query: Select[Any]) -> tuple[RunRecord, ...]:
    return tuple(RunRecord(**_values(RunRecord, row)) for row in connection.execute(query))


def _upload(connection: Connection, upload_id: str) -> Upload:
    row = connection.execute(select(uploads).where(uploads.c.id == upload_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no run {upload_id!r:.60}: POST /v1/runs takes one, or give that of a campaign")
    return Upload(**_values(Upload, row))


def _values(kind: type[RunRecord | Upload], row: Row[Any]) -> dict[str, Any]:
    return {name: getattr(row, name) for name in kind.__slots__}


def _location(connection: Connection, run_id: str) -> str:
    captured = connection.scalar(select(runs.c.location).where(runs.c.id == run_id))
    return _upload(connection, run_id).location if captured is None else str(captured)
