"""The worker that runs jobs: one at a time, in a process of lower priority than rig control."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Event, Thread

from api.errors import ApiError, LeaseLost, StoreError, one_line
from api.jobs.held_job import HeldJob, close_left_open, take_next
from api.jobs.process import JobProcess
from api.jobs.records import JobState
from api.jobs.results import Results, put_results_right, remove_old_results
from api.jobs.store import JobStore
from api.settings import Settings
from api.store.database import Database
from api.store.leases import new_owner
from api.store.part_file import PartMark
from api.store.runs import RunStore

__all__ = ["JobWorker"]

LOG = logging.getLogger("damper_rig.jobs")
_REMOVE_EVERY_S = 600.0


class JobWorker:
    """Runs the waiting jobs in order; jobs that a dead service left running are closed as failed."""

    def __init__(self, database: Database, runs: RunStore, results: Results, settings: Settings) -> None:
        self._database, self._runs, self._results, self._settings = database, runs, results, settings
        self._owner = new_owner()
        self._stop = Event()
        self._thread = Thread(target=self._work, name="jobs", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Stop; a job that was running returns to the queue."""
        self._stop.set()
        self._thread.join(self._settings.stop_s)

    def _work(self) -> None:
        remove_at = time.monotonic()
        while not self._stop.wait(self._settings.poll_s):
            try:
                if time.monotonic() >= remove_at:
                    self._put_right()
                    remove_old_results(JobStore(self._database), self._results, keep_s=self._settings.keep_results_s)
                    remove_at = time.monotonic() + _REMOVE_EVERY_S
                if close_left_open(self._database, self._owner):
                    self._put_right()
                held = take_next(self._database, self._owner, self._settings.lease_s)
                if held is not None:
                    self._run(held)
            except (LeaseLost, StoreError) as error:
                LOG.error("%s", one_line(error))
            except Exception:  # a fault of this program ends one job, not the worker
                LOG.exception("a job ended in a fault of this program")

    def _put_right(self) -> None:
        try:
            put_results_right(JobStore(self._database), self._results)
        except OSError as error:
            LOG.error("what a crash has left of results: %s", one_line(error))

    def _run(self, held: HeldJob) -> None:
        """Run a job and store how it ended; raises LeaseLost and StoreError."""
        job = held.job
        try:
            paths = self._runs.paths(job.runs), self._runs.paths(job.held_out)
            part = self._results.begin(job.id)
        except StoreError:
            raise
        except (ApiError, OSError) as error:
            held.end(JobState.FAILED, one_line(error))
            return
        done = False
        try:
            done = self._run_in_process(held, paths, part)
        except OSError as error:  # no process can be started
            held.end(JobState.FAILED, one_line(error))
        finally:
            part.end(keep=done)

    def _run_in_process(self, held: HeldJob, paths: tuple[Sequence[Path], Sequence[Path]], part: PartMark) -> bool:
        """Whether it has a result; how it ended is stored."""
        job = held.job
        folder, journal = self._results.folder(job.id), self._results.journal(job)
        most = self._settings.job_memory_bytes
        with JobProcess(
            job.kind, job.request, *paths, folder=folder, journal=journal, part=part.handle, memory_bytes=most
        ) as process:
            cancelled = self._follow(held, process)
            if self._stop.is_set():
                held.give_back()
                return False
            answer = process.answer()
        if cancelled is not None:
            held.end(JobState.CANCELLED, cancelled)
        elif answer.failure:
            held.end(JobState.FAILED, answer.failure)
        else:
            return held.end(JobState.DONE, result=answer.result) is JobState.DONE
        return False

    def _follow(self, held: HeldJob, process: JobProcess) -> str | None:
        """Wait for the end of the process; returns the reason where a cancellation was requested before."""
        seen_at = time.monotonic()
        while not process.ended(self._settings.poll_s) and not self._stop.is_set():
            done, phase = process.progress
            try:
                reason = held.progress(phase, done)
                seen_at = time.monotonic()
            except StoreError:
                if time.monotonic() - seen_at > self._settings.lease_s / 2:
                    raise
                continue
            if reason is not None:
                return reason
        return None
