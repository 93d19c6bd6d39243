"""Starts a worker process for every rig, and sees to it that the store knows when one has died."""

from __future__ import annotations

import logging
import os
import socket
import time
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from threading import Event, Thread

from sqlalchemy import delete

from api.campaigns.held_rig import hold_rig
from api.campaigns.journal import Journal
from api.campaigns.queues import pause_queue
from api.campaigns.records import RigRecord
from api.campaigns.restarts import Restarts
from api.campaigns.rig_states import Known
from api.campaigns.rig_store import RigStore
from api.campaigns.rigs import read_rig, set_rig
from api.campaigns.store import rig_resource
from api.campaigns.worker import close_left_open, journal_path
from api.errors import ApiError, NotFound, ProcessError, StoreError, one_line
from api.line.place import places
from api.line.service_end import Line, ServiceEnd
from api.processes.child import Child
from api.settings import Settings, as_environment
from api.store.database import Database
from api.store.leases import new_owner
from api.store.runs import RunStore
from api.store.tables import leases

__all__ = ["DIED", "Supervisor"]

LOG = logging.getLogger("damper_rig.worker")
DIED = "the worker of this rig has died: what the rig has done since is unknown"


@dataclass(slots=True)
class _Started:
    """A worker process of this service."""

    child: Child
    at: float


@dataclass(slots=True)
class Supervisor:
    """One worker process for every rig in service, from start to stop."""

    database: Database
    runs: RunStore
    settings: Settings
    lines: ServiceEnd
    restarts: Restarts
    _stop: Event = field(default_factory=Event)
    _started: dict[str, _Started] = field(default_factory=dict)
    _dead: SimpleQueue[tuple[str, int]] = field(default_factory=SimpleQueue)  # id of the rig, process id of the worker
    _thread: Thread | None = None

    def start(self) -> None:
        """Start; campaigns of an earlier service wait until somebody resumes their queues. Raises StoreError."""
        alive = frozenset(rig_id for rig_id, line in self.lines.lines.items() if line.open)
        RigStore(self.database).pause_after_restart(but=alive)
        for place in places(self.settings.lines_dir):
            if place.host == socket.gethostname() and not _exists(place.pid):
                self._dead.put((place.rig_id, place.pid))
        self._thread = Thread(target=self._supervise, name="workers", daemon=True)
        self._thread.start()

    def lost(self, line: Line) -> None:
        """Note that a worker has ended without a goodbye. Never waits."""
        self._dead.put((line.place.rig_id, line.place.pid))

    def stop(self) -> tuple[str, ...]:
        """Stop every worker of this service; returns the rigs that may still be powered."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(self.settings.stop_s)
        statuses: dict[str, int] = {}

        def end(rig_id: str, child: Child) -> None:
            statuses[rig_id] = child.stop(self.settings.stop_s + 5.0)

        ends = [Thread(target=end, args=(rig_id, one.child)) for rig_id, one in self._started.items()]
        for thread in ends:
            thread.start()
        for thread in ends:
            thread.join()
        late = tuple(rig_id for rig_id, status in statuses.items() if status != 0)
        for rig_id in late:
            LOG.error("rig %s: its worker ended with status %d: it may still be powered", rig_id, statuses[rig_id])
        return late

    def _supervise(self) -> None:
        while not self._stop.wait(self.settings.poll_s):
            try:
                self._note_ends()
                self._bury_dead()
                self._start_missing()
            except ApiError as error:
                LOG.error("%s", one_line(error))
            except Exception:  # a fault of this program must not leave the rigs without a supervisor
                LOG.exception("the supervisor of the workers")

    def _note_ends(self) -> None:
        """A child that has ended on its own: note when it may be started again."""
        for rig_id, one in list(self._started.items()):
            if one.child.running():
                continue
            del self._started[rig_id]
            status, pid = one.child.stop(), one.child.pid
            self.restarts.ended(rig_id, time.monotonic() - one.at)
            LOG.error("the worker of rig %s ended with status %d", rig_id, status)
            self._dead.put((rig_id, pid))

    def _bury_dead(self) -> None:
        """Tell the store of the workers that have died; raises StoreError, and tries again later."""
        while True:
            try:
                rig_id, pid = self._dead.get_nowait()
            except Empty:
                return
            try:
                self._bury(rig_id, pid)
            except StoreError:
                self._dead.put((rig_id, pid))
                raise

    def _bury(self, rig_id: str, pid: int) -> None:
        """End the lease of a dead worker, close what it left running, and pause the queue."""
        with self.database.writing() as connection:
            try:
                rig = read_rig(connection, rig_id)
            except NotFound:
                return
            mine = leases.c.owner.startswith(f"{socket.gethostname()}:{pid}:", autoescape=True)
            died = delete(leases).where((leases.c.resource == rig_resource(rig.key)) & mine)
            if connection.execute(died).rowcount == 0:
                return  # it had released the rig, or was buried before
            pause_queue(connection, rig_id, DIED)
            set_rig(connection, rig_id, state=Known.UNKNOWN, state_text=DIED)
        self.restarts.saw(rig_id, paused=True)
        held = hold_rig(self.database, rig_id, new_owner(), self.settings.lease_s)
        if held is None:  # a new worker was faster, and closes it
            return
        try:
            with Journal(journal_path(self.settings, rig_id)) as journal:
                close_left_open(held, self.runs, journal)
        finally:
            held.release()

    def _start_missing(self) -> None:
        """Start a worker for every rig in service that nobody drives."""
        for record in RigStore(self.database).rigs():
            self.restarts.saw(record.rig.id, paused=record.pause is not None)
            if not self._stop.is_set() and self._lacks_worker(record):
                self._start(record.rig.id)

    def _lacks_worker(self, record: RigRecord) -> bool:
        rig_id = record.rig.id
        line = self.lines.lines.get(rig_id)
        driven = rig_id in self._started or record.worker or (line is not None and line.open)
        return not driven and self.restarts.next_s(rig_id) is None and record.rig.out_of_service is None

    def _start(self, rig_id: str) -> None:
        folder = self.settings.lines_dir
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            child = Child(
                ["worker", rig_id], folder / f"{rig_id}.log", environ={**os.environ, **as_environment(self.settings)}
            )
        except OSError as error:
            raise ProcessError(f"the worker of rig {rig_id} cannot be started: {one_line(error)}") from error
        self._started[rig_id] = _Started(child, time.monotonic())


def _exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
