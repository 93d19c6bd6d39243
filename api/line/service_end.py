"""The service's end of its lines: what every worker says, and orders to them. It lives in one event loop."""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from api.errors import ProcessError
from api.line.messages import MOST_BYTES, Message, encode, proof, read
from api.line.place import Place, places

__all__ = ["Line", "ServiceEnd"]

LOG = logging.getLogger("damper_rig.line")
_SEEK_S = 0.1  # interval at which new workers are looked for
_CONNECT_S = 2.0


@dataclass(slots=True, kw_only=True)
class Line:
    """The line to one worker, and the last that was heard on it."""

    place: Place
    writer: asyncio.StreamWriter
    state: Message = field(default_factory=dict)
    campaign: Message = field(default_factory=dict)  # the one that was begun last
    lost_at_s: float | None = None  # seconds since 1970; None: it is open
    goodbye: str = ""  # why the worker ended; empty where it did not say so
    waiting: dict[int, asyncio.Future[Message]] = field(default_factory=dict)

    @property
    def open(self) -> bool:
        return self.lost_at_s is None


class ServiceEnd:
    """Connects to every worker that says in the folder where it listens, and notices at once when one is gone.

    ``on_live`` gets live samples, ``on_lost`` the line of a worker that ended without a goodbye; both in the loop.
    """

    def __init__(
        self,
        folder: Path,
        *,
        on_live: Callable[[Message], None] = lambda message: None,
        on_lost: Callable[[Line], None] = lambda line: None,
    ) -> None:
        self._folder, self._on_live, self.on_lost = folder, on_live, on_lost
        self.lines: dict[str, Line] = {}  # by the id of the rig; a lost one stays until there is a new one
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._number = 0

    async def run(self) -> None:
        """Look for workers until this is cancelled."""
        try:
            while True:
                for place in places(self._folder):
                    task = self._tasks.get(place.rig_id)
                    if place.host == socket.gethostname() and (task is None or task.done()):
                        self._tasks[place.rig_id] = asyncio.create_task(self._follow(place))
                await asyncio.sleep(_SEEK_S)
        finally:
            for task in self._tasks.values():
                task.cancel()

    def running(self, campaign_id: str) -> Line | None:
        """The line, open or lost, of the worker that ran this campaign when it was last heard."""
        return next((line for line in self.lines.values() if line.state.get("campaign") == campaign_id), None)

    async def order(self, line: Line, order: Message, within_s: float) -> Message | None:
        """Send an order; returns the answer, None where there is none in time."""
        if not line.open:
            return None
        self._number += 1
        number, answer = self._number, asyncio.get_running_loop().create_future()
        line.waiting[number] = answer
        try:
            line.writer.write(encode({"n": number, **order}))
            return await asyncio.wait_for(answer, within_s)
        except (TimeoutError, OSError):
            return None
        finally:
            line.waiting.pop(number, None)

    async def _follow(self, place: Place) -> None:
        """Connect to a worker and listen to it until it ends."""
        try:
            reader, writer = await asyncio.wait_for(
                asyncio.open_connection("127.0.0.1", place.port, limit=MOST_BYTES), _CONNECT_S
            )
        except (OSError, TimeoutError):  # it has died, or is about to write another place
            return
        line = Line(place=place, writer=writer)
        try:
            await asyncio.wait_for(self._prove(place, reader, writer), _CONNECT_S)
            while (message := await read(reader)) is not None:
                self._hear(line, message)
        except (ProcessError, OSError, TimeoutError) as error:
            LOG.warning("line to the worker of rig %s: %s", place.address, error)
        finally:
            writer.close()
            self._lose(line)

    async def _prove(self, place: Place, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        challenge, nonce = await read(reader) or {}, secrets.token_hex(16)
        answer = proof(place.secret, "service", str(challenge.get("nonce", "")))
        writer.write(encode({"proof": answer, "nonce": nonce}))
        said = await read(reader) or {}
        if not hmac.compare_digest(str(said.get("proof", "")), proof(place.secret, "worker", nonce)):
            raise ProcessError("whoever listens there is not the worker")

    def _hear(self, line: Line, message: Message) -> None:
        if "state" in message:
            line.state = message["state"]
            self.lines[line.place.rig_id] = line
        elif "begun" in message:
            line.campaign = message["begun"]
        elif "live" in message:
            self._on_live(message["live"])
        elif "ack" in message:
            answer = line.waiting.get(message["ack"])
            if answer is not None and not answer.done():
                answer.set_result(message)
        elif "bye" in message:
            line.goodbye = str(message["bye"])

    def _lose(self, line: Line) -> None:
        line.lost_at_s = time.time()
        for answer in line.waiting.values():
            with suppress(asyncio.InvalidStateError):
                answer.set_exception(OSError("the line to the worker broke"))
        if self.lines.get(line.place.rig_id) is line and not line.goodbye:
            self.on_lost(line)
