"""The worker of one rig: the only process that drives it, under the rig's lease."""

from __future__ import annotations

import logging
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from threading import Event

from api.campaigns.desk import Desk
from api.campaigns.envelopes import service_envelopes
from api.campaigns.held_rig import HeldRig
from api.campaigns.journal import Journal, LastWords
from api.campaigns.play import adopt_run_files, play_campaign
from api.campaigns.records import Campaign, CampaignState
from api.campaigns.rig_states import Known, after_look
from api.campaigns.rigs import Rig
from api.errors import Conflict, StoreError, one_line
from api.settings import Settings
from api.store.runs import RunStore
from rigctl.canonical import is_allowed
from rigctl.errors import IdentityError, RigError
from rigctl.operator_acts import look
from rigctl.player import connect

__all__ = ["LEFT_OPEN", "RigWorker", "close_left_open"]

LOG = logging.getLogger("damper_rig.worker")
LEFT_OPEN = "the worker that ran it died, or did not renew its lease in time: what its rig has done since is unknown"
ADOPT_S = 5.0  # interval at which run files are closed that a full disk had left open
LOOK_S = 1.0  # interval at which an idle rig is asked what it does; reading feeds no watchdog


class RigWorker:
    """Plays the campaigns of a rig in order, and asks the rig what it does while none is played."""

    def __init__(self, held: HeldRig, runs: RunStore, desk: Desk, settings: Settings, stop: Event) -> None:
        self._held, self._runs, self._desk, self._settings, self._stop = held, runs, desk, settings, stop
        self._rig = held.rig()
        self._look_at = self._keep_at = self._adopt_at = 0.0
        self._open_files = runs.left_open()  # ids of campaigns
        self._known: tuple[str, str] = ("", "")
        self._usable = False  # it has said who it is

    def run(self) -> None:
        """Work until ``stop`` is set; raises LeaseLost where another worker has taken the rig."""
        closed = False
        while not self._stop.is_set():
            try:
                if not closed:
                    close_left_open(self._held, self._runs, self._desk.journal)
                    closed = True
                self._step()
            except StoreError as error:
                LOG.error("%s", one_line(error))
                closed = False
            self._stop.wait(self._settings.poll_s)

    def _step(self) -> None:
        now = time.monotonic()
        if now >= self._look_at:
            self._look()
            self._look_at = time.monotonic() + LOOK_S
        if now >= self._keep_at:
            self._held.keep()
            self._keep_at = now + self._settings.lease_s / 4
        if why := self._desk.pause_asked:
            self._held.pause(why)
            self._desk.pause_asked = ""
        if self._open_files and now >= self._adopt_at:
            self._adopt()
            self._adopt_at = time.monotonic() + ADOPT_S
        if not self._held.has_work():
            return
        if not is_allowed(self._rig.address, self._settings.rig_patterns):
            self._held.pause(f"rig address {self._rig.address} is not allowed here: see the setting rigs_allowed")
            return
        campaign = self._held.take_next()
        if campaign is not None:
            try:
                self._play(campaign)
            finally:
                self._look()
                self._open_files |= self._runs.left_open(campaign.id)

    def _adopt(self) -> None:
        """Close and store the run files that a full disk has left open; those for which there is no room yet stay."""
        mine = self._held.own(self._open_files)
        self._open_files = frozenset(one.id for one in mine if adopt_run_files(self._held, one, self._runs))

    def _play(self, campaign: Campaign) -> None:
        self._rig = self._held.rig()
        together = _with_rig(campaign, self._rig)
        envelopes = service_envelopes(self._settings)
        play_campaign(
            self._held,
            together,
            self._runs,
            self._desk,
            stop=self._stop,
            poll_s=self._settings.poll_s,
            envelopes=envelopes,
            check=self._check,
        )

    def _check(self) -> None:
        """Raise DiskFull or RigError where no test may begin now."""
        self._runs.check_room()
        self._identify()

    def _identify(self) -> None:
        """Ask the rig who it is, before anything moves; raises RigError, and IdentityError for another rig."""
        with closing(connect(self._rig.address)) as wire:
            identity, _ = look(wire)
        try:
            self._held.identified(identity)
        except Conflict as error:
            raise IdentityError(one_line(error)) from error
        self._usable = True

    def _look(self) -> None:
        """Ask the rig what it does, and tell the services; the store only where it has changed."""
        readings = {}
        try:
            self._rig = self._held.rig()
            if not is_allowed(self._rig.address, self._settings.rig_patterns):
                known, text = Known.UNKNOWN, "its address is not allowed here: see the setting rigs_allowed"
            else:
                if not self._usable:
                    self._identify()
                with closing(connect(self._rig.address)) as wire:
                    status = wire.status(LOOK_S)
                known, text = after_look(status)
                readings = {
                    "force_n": status.force_n,
                    "displacement_m": status.displacement_m,
                    "current_a": status.current_a,
                    "temperature_degc": status.temperature_degc,
                    "pressure_pa": status.pressure_pa,
                }
        except IdentityError as error:
            known, text, self._usable = Known.OTHER, one_line(error), False
        except RigError as error:
            known, text, self._usable = Known.UNREACHABLE, one_line(error), False
        self._desk.show(known, text, readings=readings)
        if (known, text) != self._known:
            self._held.note_state(known, text)
            self._known = (known, text)


def _with_rig(campaign: Campaign, rig: Rig) -> Campaign:
    """The campaign with the rig's present address, and with what holds for every campaign on it."""
    envelopes = campaign.envelopes if rig.envelope is None else (rig.envelope, *campaign.envelopes)
    interlocks = tuple(dict.fromkeys((*rig.interlocks, *campaign.interlocks)))
    return replace(campaign, rig=rig.address, envelopes=envelopes, interlocks=interlocks)


def close_left_open(held: HeldRig, runs: RunStore, journal: Journal | None = None) -> None:
    """Close the campaigns that a worker left running, as its journal says, else as failed; every sample is kept.

    The queue is paused: what the rig has done since nobody has seen.
    """
    words = LastWords(campaign_id="") if journal is None else journal.last
    for campaign in held.left_open():
        refused = adopt_run_files(held, campaign, runs)
        if words.campaign_id == campaign.id and words.ended:
            held.end(campaign, CampaignState(words.ended), "; ".join((words.reason, *refused)), pauses=words.pauses)
            continue
        asked = f"{words.asked} was asked for: {words.reason}" if words.campaign_id == campaign.id else ""
        reason = "; ".join(part for part in (LEFT_OPEN, asked, *refused) if part)
        held.end(campaign, CampaignState.FAILED, reason, pauses=True)
    if journal is not None:
        journal.clear()


def journal_path(settings: Settings, rig_id: str) -> Path:
    return settings.lines_dir / f"{rig_id}.journal"
