"""The files of results: where they are kept, and for how long."""

from __future__ import annotations

import hashlib
import json
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree

from api.errors import Conflict, NotFound
from api.jobs.records import Job, JobState
from api.jobs.store import JobStore
from api.store.part_file import PartMark, part_files

__all__ = ["Results", "put_results_right", "remove_old_results"]

JOURNALS = "journals"  # the folder of what interrupted studies have done


@dataclass(frozen=True, slots=True)
class Results:
    """Result folders below one folder, one for each job."""

    root: Path

    def folder(self, job_id: str) -> Path:
        """Where the files of a job are written."""
        return self.root / job_id

    def file(self, job: Job, name: str, *, noun: str = "job") -> Path:
        """A file of a result; raises Conflict where the job is not done, NotFound where the file is gone."""
        if job.state is not JobState.DONE:
            why = f": {job.reason}" if job.reason else ""
            raise Conflict(f"{noun} {job.id} is {job.state}{why}: only one that is done has {name}")
        path = self.folder(job.id) / name
        if not path.is_file():
            raise NotFound(f"{name} of {noun} {job.id} is no longer among the results: submit it again")
        return path

    def journal(self, job: Job) -> Path:
        """Where a study keeps what it has done, by what was asked: the same job, sent again, goes on where one was."""
        asked = [job.kind, dict(job.request)]
        text = json.dumps(asked, sort_keys=True, default=str)
        return self.root / JOURNALS / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.journal"

    def begin(self, job_id: str) -> PartMark:
        """The folder of a job, marked as being written; raises OSError."""
        self.remove(job_id)
        return PartMark(self.folder(job_id))

    def remove(self, job_id: str) -> None:
        """Remove the files of a result; no error if there are none."""
        rmtree(self.folder(job_id), ignore_errors=True)


def put_results_right(jobs: JobStore, results: Results) -> int:
    """Remove what a crash has left of results, except what another service is writing; returns how many."""
    parts = part_files(results.root, "*")
    for part in parts:
        with suppress(NotFound):
            if jobs.one(part.stem).state is JobState.DONE:
                part.unlink(missing_ok=True)
                continue
        results.remove(part.stem)
        part.unlink(missing_ok=True)
    return len(parts)


def remove_old_results(jobs: JobStore, results: Results, *, keep_s: float) -> int:
    """Remove the files of every job that ended longer ago than ``keep_s``; its record stays. Returns how many.

    What interrupted studies have kept is removed at the same age.
    """
    old = jobs.with_files_older_than(keep_s)
    for job_id in old:
        results.remove(job_id)
        jobs.files_removed(job_id)
    for left in (results.root / JOURNALS).glob("*"):
        with suppress(OSError):  # a study may remove it meanwhile
            if time.time() - left.stat().st_mtime > keep_s:
                left.unlink()
    return len(old)
