"""``damper-rig worker``: the worker of one rig as a process, from its lease to a rig at rest without current."""

from __future__ import annotations

import logging
import os
import signal
import socket
from collections.abc import Callable
from threading import Event, Thread
from types import FrameType

from api.access.logs import start_log
from api.campaigns.desk import Desk
from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.journal import Journal
from api.campaigns.rig_states import Known
from api.campaigns.worker import RigWorker, journal_path
from api.errors import LeaseLost, StoreError, one_line
from api.line.place import Place, remove_place, write_place
from api.line.worker_end import WorkerEnd
from api.processes.lasting import keep_what_is_there
from api.processes.signals import ending_signals
from api.settings import Settings
from api.store.database import Database
from api.store.leases import new_owner
from api.store.runs import open_runs

__all__ = ["run_worker"]

LOG = logging.getLogger("damper_rig.worker")
RESTARTED = "the worker of this rig was restarted"


def run_worker(settings: Settings, rig: str, *, supervised: bool, on_ready: Callable[[str], None]) -> int:
    """Drive one rig until a signal ends the process; returns 0, or 1 where it may still be powered.

    ``supervised``: a service has started this worker, and pauses the queue itself where it must be.
    Raises StoreError, InputError, ProcessError where it cannot begin.
    """
    start_log(settings.log_format)
    stop = Event()
    _stop_on_signals(stop)
    with Database(settings.store_url) as database:
        held = _hold(database, rig, settings, stop)
        if held is None:
            return 0
        if not supervised:
            held.pause_after_restart(RESTARTED)
        with Journal(journal_path(settings, held.rig_id)) as journal:
            desk = Desk(held.rig().address, journal)
            line = WorkerEnd(desk.obey)
            desk.keep, desk.tell = line.keep, line.tell
            desk.show(Known.UNKNOWN, "it has not been asked yet")
            line.start()
            _announce(settings, held, line)
            keep_what_is_there()
            on_ready(held.rig_id)
            try:
                return _work_until_stopped(
                    RigWorker(held, open_runs(database, settings), desk, settings, stop), desk, stop, settings
                )
            finally:
                remove_place(settings.lines_dir, held.rig_id, os.getpid())
                line.close("it was stopped" if stop.is_set() else "")
                _release(held)


def _work_until_stopped(worker: RigWorker, desk: Desk, stop: Event, settings: Settings) -> int:
    """The worker has a thread of its own: a store that hangs must not keep this process from its end."""
    failures: list[BaseException] = []

    def work() -> None:
        try:
            worker.run()
        except (LeaseLost, StoreError) as error:
            LOG.error("%s", one_line(error))
            failures.append(error)
        except BaseException as error:
            LOG.exception("the worker ended in a fault of this program")
            failures.append(error)
        finally:
            stop.set()

    thread = Thread(target=work, name="rig", daemon=True)
    thread.start()
    while not stop.wait(0.5):
        pass
    thread.join(settings.stop_s)
    if desk.playing:
        LOG.error("rig %s: not released within %g s: it may still be powered", desk.address, settings.stop_s)
    if thread.is_alive():
        logging.shutdown()
        os._exit(1 if desk.playing else 0)  # the store hangs: the next worker closes the campaign from the journal
    return 1 if desk.playing or failures else 0


def _hold(database: Database, rig: str, settings: Settings, stop: Event) -> HeldRig | None:
    """The rig, as soon as no other worker holds it; None where this one is stopped before."""
    owner = new_owner()
    while not stop.is_set():
        held = hold_rig(database, rig, owner, settings.lease_s)
        if held is not None:
            return held
        stop.wait(settings.poll_s)
    return None


def _announce(settings: Settings, held: HeldRig, line: WorkerEnd) -> None:
    place = Place(
        rig_id=held.rig_id,
        address=held.rig().address,
        port=line.port,
        secret=line.secret,
        host=socket.gethostname(),
        pid=os.getpid(),
    )
    write_place(settings.lines_dir, place)


def _release(held: HeldRig) -> None:
    try:
        held.release()
    except StoreError as error:
        LOG.error("%s", one_line(error))


def _stop_on_signals(stop: Event) -> None:
    def told(number: int, frame: FrameType | None) -> None:
        stop.set()

    for number in ending_signals():
        signal.signal(number, told)
