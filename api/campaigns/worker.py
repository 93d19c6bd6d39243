"""Workers: a thread for each rig that has work, under the lease of the rig."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from threading import Event, Thread

from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.live import Live
from api.campaigns.play import adopt_run_files, play_campaign
from api.campaigns.records import CampaignState
from api.campaigns.store import CampaignStore
from api.errors import LeaseLost, StoreError, one_line
from api.settings import Settings
from api.store.database import Database
from api.store.leases import new_owner
from api.store.runs import RunStore

__all__ = ["Workers", "work"]

LOG = logging.getLogger("damper_rig.worker")
LEFT_OPEN = "the worker that ran it did not renew its lease in time"


def work(
    database: Database, runs: RunStore, live: Live, *, rig: str, owner: str, settings: Settings, stop: Event
) -> None:
    """Play every campaign that waits for a rig, in order; returns when none waits or ``stop`` is set.

    Returns at once where another worker holds the rig. Campaigns that a dead worker left running are closed first.
    """
    held = hold_rig(database, rig, owner, settings.lease_s)
    if held is None:
        return
    try:
        close_left_open(held, runs)
        while not stop.is_set() and (campaign := held.take_next()) is not None:
            play_campaign(held, campaign, runs, live, stop=stop, poll_s=settings.poll_s)
    finally:
        held.release()


def close_left_open(held: HeldRig, runs: RunStore) -> None:
    """Close the campaigns that a dead worker left running as failed; every sample on the disk is kept."""
    for campaign in held.left_open():
        refused = adopt_run_files(held, campaign, runs)
        held.end(campaign, CampaignState.FAILED, "; ".join((LEFT_OPEN, *refused)))


class Workers:
    """One worker thread for every rig that has work, from start to stop."""

    def __init__(self, database: Database, runs: RunStore, live: Live, settings: Settings) -> None:
        self._settings, self._campaigns = settings, CampaignStore(database)
        self._stop = Event()
        self._owner = new_owner()
        self._work: Callable[[str], None] = lambda rig: work(
            database, runs, live, rig=rig, owner=self._owner, settings=settings, stop=self._stop
        )
        self._threads: dict[str, Thread] = {}
        self._supervisor = Thread(target=self._supervise, name="workers", daemon=True)

    def start(self) -> None:
        self._supervisor.start()

    def stop(self) -> tuple[str, ...]:
        """Stop every worker; returns the rigs that were not released by the deadline: they may be powered."""
        self._stop.set()
        ends = time.monotonic() + self._settings.stop_s
        for thread in (self._supervisor, *self._threads.values()):
            thread.join(max(0.0, ends - time.monotonic()))
        late = tuple(rig for rig, thread in self._threads.items() if thread.is_alive())
        for rig in late:
            LOG.error("rig %s: not released within %g s: it may still be powered", rig, self._settings.stop_s)
        return late

    def _supervise(self) -> None:
        while not self._stop.wait(self._settings.poll_s):
            try:
                rigs = self._campaigns.rigs_with_work()
            except StoreError as error:
                LOG.error("%s", one_line(error))
                continue
            for rig in rigs:
                if rig not in self._threads or not self._threads[rig].is_alive():
                    self._threads[rig] = Thread(target=self._run, args=(rig,), name=f"rig {rig}", daemon=True)
                    self._threads[rig].start()

    def _run(self, rig: str) -> None:
        try:
            self._work(rig)
        except (LeaseLost, StoreError) as error:
            LOG.error("%s", one_line(error))
