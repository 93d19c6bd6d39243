"""The exchange between a streaming player and the store: the stream never waits for the database."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Self

from api.campaigns.desk import Desk, LocalOrder
from api.campaigns.held_rig import HeldRig
from api.campaigns.orders import ENDS, Asked, Order, combine
from api.campaigns.records import Campaign
from api.errors import LeaseLost, StoreError, one_line
from rigctl.progress import Phase, Progress

__all__ = ["SHUTDOWN", "STORE_AWAY", "Watch", "said_of"]

LOG = logging.getLogger("damper_rig.worker")
STORE_AWAY = "the campaign store does not answer: the log of the worker says why"
SHUTDOWN = "the service was stopped"
_HUNG = 0.6  # of the lease: a call of the store that does not even fail, where a server hangs; later than a failing one


def said_of(error: LeaseLost | StoreError) -> str:
    """Why a campaign ends for which the store cannot be used, without the store's address."""
    return one_line(error) if isinstance(error, LeaseLost) else STORE_AWAY


class Watch:
    """Keeps the progress of one campaign and the requests for it, and exchanges them with the store in a thread.

    Orders also come over the line, past the store; the thread tells the store of them as soon as it answers. It renews
    the lease as long as the player calls one of the methods. Where the lease is lost, or the store has not answered for
    half of the lease's time, the player must stop; ``failure`` is the reason.
    """

    def __init__(
        self,
        held: HeldRig,
        campaign: Campaign,
        desk: Desk,
        *,
        stop: Event,
        poll_s: float,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._held, self._campaign, self._desk, self._now = held, campaign, desk, now
        self._stop, self._poll_s = stop, poll_s
        self._lock = Lock()
        self._position = 0
        self._latest: Progress | None = None
        self._reason: str | None = None
        self._asked = Asked.NOTHING
        self._told = LocalOrder()
        self._player_at = self._store_at = now()
        self._ended = Event()
        self._thread = Thread(target=self._exchange, name=f"watch {campaign.id}", daemon=True)
        self.failure: LeaseLost | StoreError | None = None

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()  # its last call ends by the store's deadline

    def begin(self, position: int) -> None:
        """The test at ``position`` of the campaign is the next one."""
        with self._lock:
            self._position, self._latest = position, None

    def should_stop(self) -> str | None:
        """Why the test must stop, None where it need not. Does not wait for the store."""
        now = self._player_at = self._now()
        local = self._desk.order()
        if self._reason is None and local.asked in ENDS:
            self._reason = local.reason
        if self._reason is None and self._stop.is_set():
            self._reason = SHUTDOWN
        if self._reason is None and now - self._store_at > _HUNG * self._held.lease.length_s:
            self._fail(StoreError(f"the store has not answered for {now - self._store_at:.0f} s"))
        return self._reason

    def should_hold(self) -> bool:
        """Whether the test must hold. Does not wait for the store."""
        self._player_at = self._now()
        return self._wish() is Asked.HOLD

    def should_return(self) -> bool:
        """Whether a rig that was stopped travels back to mid-stroke. Does not wait for the store."""
        self._player_at = self._now()
        return self._wish() is Asked.STOP

    def _wish(self) -> Asked:
        """What holds of the requests in the store and of those over the line."""
        local = self._desk.order().asked
        return (combine(self._asked, local) or self._asked) if local in ENDS else self._asked

    def on_progress(self, progress: Progress) -> None:
        """Keep the progress; the thread writes it to the store."""
        self._player_at = self._now()
        self._desk.publish(self._campaign.id, progress)
        self._desk.progress(progress, hold_asked=self._asked is Asked.HOLD)
        with self._lock:
            self._latest = progress

    def waits(self, test: str) -> None:
        """Say that the campaign is held between two tests: the rig is switched off."""
        rests = Progress(test=test, phase=Phase.HOLD, samples=0, total_samples=0)
        self._desk.progress(rests, hold_asked=True)

    def _exchange(self) -> None:
        while not self._ended.wait(self._poll_s) and self.failure is None:
            if self._now() - self._player_at > self._held.lease.length_s:
                continue  # the player does not respond: let the lease expire
            try:
                self._apply(self._report())
                self._store_at = self._now()
            except LeaseLost as error:
                self._fail(error)
            except StoreError as error:
                if self._now() - self._store_at > self._held.lease.length_s / 2:
                    self._fail(error)

    def _report(self) -> Order:
        local = self._desk.order_to_tell
        if local.asked in ENDS and local != self._told:
            self._held.note_order(self._campaign, local.asked, local.reason)
            self._told = local
        with self._lock:
            position, latest, self._latest = self._position, self._latest, None
        if latest is None or latest.phase is Phase.STOPPED:
            return self._held.renew(self._campaign)
        return self._held.progress(self._campaign, position, latest.phase, latest.samples, latest.text)

    def _apply(self, order: Order) -> None:
        self._asked = order.asked
        if self._reason is None:
            self._reason = order.reason

    def _fail(self, error: LeaseLost | StoreError) -> None:
        LOG.error("%s", one_line(error))
        self._apply(Order(asked=Asked.ABORT, reason=said_of(error)))
        self.failure = error
