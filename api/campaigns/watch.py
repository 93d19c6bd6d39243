"""The exchange between a streaming player and the store: the stream never waits for the database."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Self

from api.campaigns.held_rig import HeldRig
from api.campaigns.live import Live
from api.campaigns.orders import Asked, Order
from api.campaigns.records import Campaign
from api.errors import LeaseLost, StoreError, one_line
from rigctl.progress import Phase, Progress

__all__ = ["SHUTDOWN", "Watch"]

SHUTDOWN = "the service was stopped"


class Watch:
    """Keeps the progress of one campaign and the requests for it, and exchanges them with the store in a thread.

    The thread renews the lease as long as the player calls one of the methods. Where the lease is lost, or the store
    has not answered for half of the lease's time, the player must stop; ``failure`` is the reason.
    """

    def __init__(
        self,
        held: HeldRig,
        campaign: Campaign,
        live: Live,
        *,
        stop: Event,
        poll_s: float,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._held, self._campaign, self._live, self._now = held, campaign, live, now
        self._stop, self._poll_s = stop, poll_s
        self._lock = Lock()
        self._position = 0
        self._latest: Progress | None = None
        self._reason: str | None = None
        self._asked = Asked.NOTHING
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
        self._player_at = self._now()
        if self._reason is None and self._stop.is_set():
            self._reason = SHUTDOWN
        return self._reason

    def should_hold(self) -> bool:
        """Whether the test must hold. Does not wait for the store."""
        self._player_at = self._now()
        return self._asked is Asked.HOLD

    def should_return(self) -> bool:
        """Whether a rig that was stopped travels back to mid-stroke. Does not wait for the store."""
        self._player_at = self._now()
        return self._asked is Asked.STOP

    def on_progress(self, progress: Progress) -> None:
        """Keep the progress; the thread writes it to the store."""
        self._player_at = self._now()
        if progress.block is not None:
            values = progress.block.values
            self._live.publish(self._campaign.id, progress.test, values[:, 1], values[:, 0])
        with self._lock:
            self._latest = progress

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
        self._apply(Order(asked=Asked.ABORT, reason=one_line(error)))
        self.failure = error
