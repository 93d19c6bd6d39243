"""Where orders that come over the line meet the campaign that is played. No store is asked, and nothing waits."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, field
from threading import Lock, Thread
from typing import Any

from api.campaigns.journal import Journal, LastWords
from api.campaigns.live_loop import LiveLoop
from api.campaigns.orders import ENDS, Asked, combine
from api.campaigns.records import Campaign
from api.campaigns.rig_states import Known, while_playing
from api.campaigns.short_campaign import as_json
from api.errors import one_line
from rigctl.errors import RigError
from rigctl.operator_acts import look, stop
from rigctl.player import connect
from rigctl.progress import Progress

__all__ = ["Desk", "LocalOrder"]

LOG = logging.getLogger("damper_rig.worker")
ANSWER_S = 0.12  # for the player to see an order: it looks every 0.02 s; then the rig is sent a stop past the player
PAUSED_S = 1.0  # for the store to hear that the queue pauses, before somebody reads that the rig is safe
_NO_CURRENT_A = 0.02  # what the sensor may show of a coil without current: its offset


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalOrder:
    """What was asked over the line of the campaign that is played."""

    asked: Asked = Asked.NOTHING
    reason: str = ""


@dataclass(slots=True)
class Desk:
    """Takes orders for the rig of one worker, and says what the rig does. Safe to use from many threads."""

    address: str
    journal: Journal | None = None
    keep: Callable[[str, dict[str, Any]], None] = lambda kind, value: None  # Any: JSON
    tell: Callable[[dict[str, Any]], None] = lambda message: None
    _lock: Lock = field(default_factory=Lock)
    _campaign: str = ""
    _order: LocalOrder = LocalOrder()
    _ordered_at: float = 0.0
    _seen_at: float = 0.0  # when the player looked at its orders
    pause_asked: str = ""  # why the queue pauses, until the store knows
    _playing: bool = False  # the rig may be under power
    _state: dict[str, Any] = field(default_factory=dict)
    _loop: LiveLoop | None = None  # of the test that is played
    _loop_of: tuple[str, str] = ("", "")

    def begin(self, campaign: Campaign) -> None:
        """A campaign is played from now on."""
        with self._lock:
            self._campaign, self._order, self._seen_at = campaign.id, LocalOrder(), time.monotonic()
            self._playing = True
        self.keep("begun", as_json(campaign))
        self.show(Known.RUNNING, "a campaign begins")

    def end(self) -> None:
        """No campaign is played any more: the rig was made safe, or said that it could not be."""
        with self._lock:
            self._campaign, self._order, self._playing = "", LocalOrder(), False

    @property
    def playing(self) -> bool:
        return self._playing

    def order(self) -> LocalOrder:
        """What was asked of the campaign that is played; the player calls this again and again."""
        self._seen_at = time.monotonic()
        return self._order

    @property
    def order_to_tell(self) -> LocalOrder:
        """The same, for somebody else than the player."""
        return self._order

    def obey(self, message: dict[str, Any]) -> Any:
        """Take an order from the line; returns an answer, or a function that leads to it. Any: JSON."""
        match message.get("do"):
            case "stop" | "abort" as wish:
                return self._end(Asked(wish), str(message.get("campaign", "")), str(message.get("reason", "")))
            case "make safe":
                ended = self._end(Asked.ABORT, "", str(message.get("reason", "")))
                return lambda: {**self._make_safe(), "campaign": ended["campaign"]}
            case other:
                return {"ok": False, "text": f"{other!r:.40} is no order"}

    def _end(self, wish: Asked, campaign_id: str, reason: str) -> dict[str, Any]:
        with self._lock:
            mine = self._campaign
            self.pause_asked = self.pause_asked if campaign_id else reason
            if campaign_id and campaign_id != mine:
                return {"ok": False, "campaign": mine, "text": f"campaign {campaign_id} is not played here"}
            if not mine:
                return {"ok": False, "campaign": "", "text": "no campaign is played"}
            asked = combine(self._order.asked, wish) or wish
            self._order = LocalOrder(asked=asked, reason=self._order.reason or reason)
            self._ordered_at = time.monotonic()
        if self.journal is not None:
            self.journal.note(LastWords(campaign_id=mine, asked=asked, reason=self._order.reason))
        Thread(target=self._insist, name="insist", daemon=True).start()
        return {"ok": True, "campaign": mine, "text": ""}

    def _make_safe(self) -> dict[str, Any]:
        safe = make_safe(self.address, wait=lambda: self._playing)
        ends = time.monotonic() + PAUSED_S
        while self.pause_asked and time.monotonic() < ends:
            time.sleep(0.02)
        return safe

    def _insist(self) -> None:
        """Send the rig a stop past a player that does not look at its orders: its wire or its disk keeps it."""
        time.sleep(ANSWER_S)
        if self._playing and self._seen_at < self._ordered_at:
            with suppress(RigError), closing(connect(self.address)) as wire:
                stop(wire)

    def progress(self, progress: Progress, *, hold_asked: bool) -> None:
        """Say how far the test is."""
        asked = self._order.asked
        known = while_playing(progress.phase, hold_asked=hold_asked, end_asked=asked in ENDS)
        shown: dict[str, Any] = {
            "test": progress.test,
            "phase": progress.phase,
            "samples": progress.samples,
            "total_samples": progress.total_samples,
            "fifo": progress.fifo,
        }
        if progress.block is not None and progress.block.samples:
            names = ("force_n", "displacement_m", "current_a", "temperature_degc", "pressure_pa")
            shown["readings"] = dict(zip(names, progress.block.values[-1].tolist(), strict=False))
        self.show(known, progress.text or str(progress.phase), **shown)

    def publish(self, campaign_id: str, progress: Progress) -> None:
        """Send the points that the newest samples complete to whoever looks on."""
        block, test = progress.block, (campaign_id, progress.test)
        if block is None or not progress.sample_rate_hz:
            return
        if self._loop is None or self._loop_of != test:
            self._loop, self._loop_of = LiveLoop(rate_hz=progress.sample_rate_hz), test
        points = self._loop.take(block.first_index, block.values[:, 1], block.values[:, 0])
        if points is not None:
            self.tell({"live": {"campaign_id": campaign_id, "test": progress.test, **asdict(points)}})

    def show(self, known: Known, text: str, **more: Any) -> None:
        """Say what is known of the rig. Any: JSON."""
        self._state = {"state": known, "text": text, "at_s": time.time(), "campaign": self._campaign, **more}
        self.keep("state", self._state)


def make_safe(address: str, *, wait: Callable[[], bool] = lambda: False, within_s: float = 4.0) -> dict[str, Any]:
    """Stop a rig, whoever commands it, and make sure that it is off and without current. Any: JSON.

    ``wait`` says whether a player is still at it: it brings the rig to rest more gently, and closes its file.
    ``text`` is shown to clients: what a library said of the wire is in the log only.
    """
    ends = time.monotonic() + within_s
    while wait() and time.monotonic() < ends:
        time.sleep(0.02)
    try:
        with closing(connect(address)) as wire:
            stop(wire)
            status = look(wire)[1]
            while abs(status.current_a) > _NO_CURRENT_A and time.monotonic() < ends + 2.0:
                time.sleep(0.02)  # the current of a coil decays
                status = look(wire)[1]
    except RigError as error:
        LOG.error("rig %s could not be made safe: %s", address, one_line(error))
        return {"ok": False, "text": "it did not say that it is at rest: the log says why"}
    safe = abs(status.current_a) <= _NO_CURRENT_A
    text = f"{status.state.name}, {status.current_a:.3f} A, at rest: {'yes' if status.arrived else 'no'}"
    return {"ok": safe, "text": text if safe else f"{text}: the current has not gone"}
