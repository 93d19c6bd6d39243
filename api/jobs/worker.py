"""The worker that explains: one explanation at a time in a process of its own, so that a rig never waits for it."""

from __future__ import annotations

import logging
import os
import socket
import time
from shutil import rmtree
from threading import Event, Thread
from uuid import uuid4

from api.campaigns.records import Explanation, ExplanationState
from api.errors import DoorError, LeaseLost, StoreError, one_line
from api.jobs.process import Job
from api.jobs.results import Reports
from api.jobs.store import ExplanationStore
from api.settings import Settings
from api.store.runs import RunFiles

__all__ = ["Explainer"]

LOG = logging.getLogger("damper_rig.explainer")


class Explainer:
    """Takes what waits, in order, as long as it runs; what a dead service left behind is closed truthfully."""

    def __init__(self, store: ExplanationStore, files: RunFiles, reports: Reports, settings: Settings) -> None:
        self._store, self._files, self._reports, self._settings = store, files, reports, settings
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{uuid4().hex[:8]}"
        self._stop = Event()
        self._thread = Thread(target=self._work, name="explainer", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """End the work; what was begun waits in the store for the next service."""
        self._stop.set()
        self._thread.join(self._settings.stop_s)

    def _work(self) -> None:
        while not self._stop.wait(self._settings.poll_s):
            try:
                self._store.close_left_open()
                asked = self._store.take_next(self._owner, self._settings.lease_s)
                if asked is not None:
                    self._explain(asked)
            except (LeaseLost, StoreError) as error:
                LOG.error("%s", one_line(error))
            except Exception:  # a fault of this program ends one explanation, never the worker
                LOG.exception("explaining ended in a fault of this program")

    def _explain(self, asked: Explanation) -> None:
        """Explain it and write down how it ended; raises LeaseLost and StoreError."""
        try:
            paths = [
                [self._files.at(place) for place in self._store.locations(ids)] for ids in (asked.runs, asked.held_out)
            ]
            folder = self._reports.work_dir(asked.id)
            job = Job(asked.model, *paths, output=folder, reproduce=reproduce(asked))
        except StoreError:
            raise
        except (DoorError, OSError) as error:
            self._store.end(asked.id, self._owner, ExplanationState.FAILED, one_line(error))
            return
        with job:
            cancelled = self._followed(asked, job)
            if self._stop.is_set():
                self._store.give_back(asked.id, self._owner)
                return
            found = job.finding()
        if cancelled is not None or found.trouble:
            rmtree(folder, ignore_errors=True)  # what was begun of a report is none
        if cancelled is not None:
            self._store.end(asked.id, self._owner, ExplanationState.CANCELLED, cancelled)
        elif found.trouble:
            self._store.end(asked.id, self._owner, ExplanationState.FAILED, found.trouble)
        else:
            self._store.end(asked.id, self._owner, ExplanationState.DONE, verdict=found.verdict, effects=found.effects)

    def _followed(self, asked: Explanation, job: Job) -> str | None:
        """Wait for the job's end; the reason where somebody asked for it before."""
        seen_at = time.monotonic()
        while not job.ended(self._settings.poll_s) and not self._stop.is_set():
            done, phase = job.progress
            try:
                reason = self._store.sign_of_life(asked.id, self._owner, self._settings.lease_s, phase, done)
                seen_at = time.monotonic()
            except StoreError:
                if time.monotonic() - seen_at > self._settings.lease_s / 2:
                    raise
                continue
            if reason is not None:
                return reason
        return None


def reproduce(asked: Explanation) -> str:
    """The command that makes the report again from the files that the service gives out."""
    runs = " ".join(f"{name}.h5" for name in asked.runs)
    held = f" --held-out {' '.join(f'{name}.h5' for name in asked.held_out)}" if asked.held_out else ""
    model = "--simulated" if asked.model is None else "MODEL.json"
    return f"damper-rig explain {model} {runs}{held} -o report"
