"""What /v1/live sends: read from the store once for all watchers, by one thread, and put into words once."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from threading import Event, Lock, Thread

from api.campaigns.records import Campaign, CampaignState, RigRecord
from api.campaigns.rigs import Rig
from api.errors import StoreError, one_line
from api.routes.answers import explanation_answer, summary
from api.routes.feed_news import Reading, event, lists, news
from api.routes.queue_answers import queue_answer
from api.routes.rig_answers import RigList, rig_answer
from api.service import Service

__all__ = ["Feed"]

TICK_S = 0.25
BEAT_S = 0.5  # something is sent at least as often: the page says after 1.6 s without it that the service is away
_IDLE_S = 1.0  # without a watcher only the rigs are read: the stop path must know them
_READING_SHARE = 0.2  # of a processor, at most: a store of long plans is read less often
_SHOWN = 20  # the newest, those that run, and those that wait
_KEPT_TICKS = 12  # a watcher that is later than that gets the lists again
_BEAT = "event: beat\ndata:\n\n"
_SILENT_S = 3.0  # of the store, until the watchers are told


class Feed:
    """The newest events, numbered by ticks, and the same bytes for every watcher; watchers wait for the next one."""

    def __init__(self, service: Service, on_rigs: Callable[[dict[str, Rig]], None] = lambda rigs: None) -> None:
        self._service, self._on_rigs = service, on_rigs
        self.watchers = 0
        self._tick, self._block = 0, 0
        self._said: deque[tuple[int, bytes]] = deque(maxlen=_KEPT_TICKS)
        self._rigs = self._trouble = ""  # the newest event of each
        self._beat_at = 0.0
        self._lock = Lock()  # for what the reading thread leaves here
        self._reading: Reading | None = None
        self._waiting: list[str] = []
        self._records: tuple[RigRecord, ...] = ()
        self._failed = ""
        self._read_at = time.monotonic()
        self._stop, self._wanted = Event(), Event()
        self._next = asyncio.Event()
        self._thread = Thread(target=self._read, name="feed", daemon=True)

    async def run(self) -> None:
        """Make a tick every 0.25 s until this is cancelled."""
        self._thread.start()
        try:
            while True:
                self._make_tick()
                await asyncio.sleep(TICK_S)
        finally:
            self._stop.set()
            self._wanted.set()
            self._next.set()

    def begin(self) -> tuple[int, bytes]:
        """The number of the newest tick, and everything as it is now; the first watcher gets it with the next tick."""
        self._wanted.set()
        with self._lock:
            known = lists(self._reading) if self._reading is not None else []
        return self._tick, "".join([_BEAT, *known, self._rigs, self._trouble]).encode()

    async def after(self, tick: int) -> tuple[int, bytes]:
        """What has been said after ``tick``, as soon as there is something; where that is forgotten, everything."""
        while self._tick <= tick and not self._stop.is_set():
            await self._next.wait()
        if self._stop.is_set() or self._tick <= tick:
            return self._tick, b""
        if self._tick == tick + 1:
            return self._said[-1]
        if self._said[0][0] > tick + 1:
            return self.begin()
        return self._tick, b"".join(text for number, text in self._said if number > tick)

    def _make_tick(self) -> None:
        with self._lock:
            said, self._waiting = self._waiting, []
            records, trouble = self._records, self._failed
        silent_s = time.monotonic() - self._read_at
        if silent_s > _SILENT_S:
            trouble = f"the store has not answered for {silent_s:.0f} s"
        told = event("trouble", {"detail": trouble}) if trouble else ""
        if told != self._trouble:
            said.append(told or event("trouble", {"detail": ""}))
        known = RigList(rigs=[rig_answer(one, self._service) for one in records]).model_dump(mode="json")
        rigs = event("rigs", known)
        said += [rigs] if rigs != self._rigs else []
        self._rigs, self._trouble = rigs, told
        blocks = self._service.live.after(self._block)
        if blocks:
            self._block = blocks[-1].number
            said.append(event("samples", [block.said for block in blocks]))
        now = time.monotonic()
        if now - self._beat_at >= BEAT_S - TICK_S / 2:
            self._beat_at = now
            said.append(_BEAT)
        if said:
            self._say("".join(said).encode())

    def _say(self, text: bytes) -> None:
        self._tick += 1
        self._said.append((self._tick, text))
        before, self._next = self._next, asyncio.Event()
        before.set()

    def _read(self) -> None:
        """Read the store again and again, in a thread that nothing else waits for."""
        while not self._stop.is_set():
            self._wanted.clear()
            begun = time.monotonic()
            watched = self.watchers > 0
            try:
                self._read_once(watched)
                failed = ""
            except StoreError as error:
                failed = one_line(error)
            with self._lock:
                self._failed, self._read_at = failed, time.monotonic()
            took_s = self._read_at - begun
            if watched:
                self._stop.wait(max(TICK_S, took_s / _READING_SHARE))
            else:
                self._wanted.wait(_IDLE_S)

    def _read_once(self, watched: bool) -> None:
        records = self._service.rigs.rigs()
        self._on_rigs({record.rig.id: record.rig for record in records})
        reading = self._lists_now(records) if watched else None
        with self._lock:
            self._records = records
            if reading is not None:
                self._waiting += news(self._reading, reading)
            self._reading = reading

    def _lists_now(self, records: tuple[RigRecord, ...]) -> Reading:
        service = self._service
        found: dict[int, Campaign] = {}
        for state in (None, CampaignState.RUNNING, CampaignState.ACCEPTED):
            found |= {one.number: one for one in service.campaigns.campaigns(limit=_SHOWN, state=state)}
        queues = {
            one.rig.id: queue_answer(service.rigs.queue(one.rig.id)).model_dump(mode="json")
            for one in records
            if one.accepted
        }
        explained = service.explanations.newest(limit=_SHOWN)
        return Reading(
            campaigns=[summary(found[number]).model_dump(mode="json") for number in sorted(found, reverse=True)],
            explanations=[explanation_answer(one).model_dump(mode="json") for one in explained],
            queues=queues,
        )
