"""Stop, abort and make safe, in front of everything else: no store, no thread of a pool, no body is read.

An order goes over the line to the worker that drives the rig. Where it does not answer, or has died, this process sends
the rig a stop itself, over the wire, in a thread that exists for that. What it cannot answer from what it knows itself
goes to the routes, which ask the store.
"""

from __future__ import annotations

import asyncio
import json
import logging
import re
from dataclasses import dataclass, field
from threading import Thread
from typing import Any

from starlette.types import ASGIApp, Receive, Scope, Send

from api.campaigns.desk import make_safe
from api.campaigns.orders import Asked
from api.campaigns.rigs import Rig
from api.campaigns.short_campaign import with_progress
from api.line.service_end import Line, ServiceEnd
from api.problems import send_problem
from api.processes.spares import Spares
from api.routes.answers import summary

__all__ = ["StopLayer", "Stops"]

LOG = logging.getLogger("damper_rig.service")
ACKNOWLEDGE_S = 0.06  # a worker answers within 0.01 s; then the stop is sent past it: 0.2 s for all is the limit
_OF_A_STOP = 4  # descriptors: the connection to the rig, and what a client of its protocol opens beside
SAFE_S = 8.0  # for a rig to come to rest, to switch off, and for its current to decay
_CAMPAIGN = re.compile(r"/v1/campaigns/([^/]{1,64})/(stop|abort)")
_RIG = re.compile(r"/v1/rigs/([^/]{1,500})/(stop|make-safe)")

Answer = tuple[int, dict[str, Any]]  # status and body. Any: JSON


@dataclass(slots=True)
class Stops:
    """What this process knows without the store: the lines to the workers, and the rigs as they were read last."""

    lines: ServiceEnd
    rigs: dict[str, Rig] = field(default_factory=dict)  # by their ids
    spares: Spares | None = None  # descriptors for a connection to a rig
    _loop: asyncio.AbstractEventLoop | None = None

    @property
    def loop(self) -> asyncio.AbstractEventLoop:
        """The loop of the lines; it runs as long as the service does."""
        assert self._loop is not None
        return self._loop

    def begin(self) -> None:
        """Note the loop in which this is called."""
        self._loop = asyncio.get_running_loop()

    def know(self, rigs: dict[str, Rig]) -> None:
        """Take the rigs as they are in the store now."""
        self.rigs = rigs

    def rig_called(self, text: str) -> tuple[str, str] | None:
        """The id and address of the rig with this id, serial number or name; None where it is not known here."""
        if (line := self.lines.lines.get(text)) is not None:
            return text, line.place.address
        named = [rig for rig in self.rigs.values() if text in (rig.id, rig.serial, rig.name)]
        return (named[0].id, named[0].address) if len(named) == 1 else None

    async def campaign(self, campaign_id: str, wish: str, by: str) -> Answer | None:
        """Stop or abort a campaign that runs; None where no worker has said that it plays it."""
        line = self.lines.running(campaign_id)
        if line is None:
            return None
        reason = f"{'a stop' if wish == 'stop' else 'an abort'} was requested over HTTP{by}"
        said = await self.lines.order(line, {"do": wish, "campaign": campaign_id, "reason": reason}, ACKNOWLEDGE_S)
        if said is None:
            return await self._past_worker(line.place.address, _about(line, campaign_id, wish, reason))
        if not said.get("ok"):  # it plays another one by now
            return None
        return 202, {**_about(line, campaign_id, wish, reason), "acknowledged": True, "by": "worker"}

    async def rig(self, rig_id: str, address: str, wish: str, by: str) -> Answer:
        """Stop whatever moves on a rig, or make it safe and say what it is in then."""
        line = self.lines.lines.get(rig_id)
        reason = f"{'a stop of the rig' if wish == 'stop' else 'make safe'} was requested over HTTP{by}"
        about = {"rig": rig_id, "address": address, "asked": wish, "reason": reason}
        if wish == "make-safe":
            safe = await self.lines.order(line, {"do": "make safe", "reason": reason}, SAFE_S) if line else None
            if safe is not None and safe.get("ok"):
                return 200, {**about, "acknowledged": True, "by": "worker", "safe": True, "text": safe["text"]}
            return await self._past_worker(address, about)
        said = await self.lines.order(line, {"do": "abort", "reason": reason}, ACKNOWLEDGE_S) if line else None
        if said is not None and said.get("ok"):
            return 202, {**about, "acknowledged": True, "by": "worker", "campaign": said["campaign"]}
        return await self._past_worker(address, about)

    async def _past_worker(self, address: str, about: dict[str, Any]) -> Answer:
        if self.spares is not None:
            self.spares.lend(_OF_A_STOP)
        safe = await past_worker(address)
        if safe["ok"]:
            return 202, {**about, "acknowledged": True, "by": "service", "safe": True, "text": safe["text"]}
        text = f"rig {address}: the stop was not acknowledged: press the emergency stop ({safe['text']})"
        return 504, {**about, "acknowledged": False, "by": "service", "safe": False, "detail": text}


def _about(line: Line, campaign_id: str, wish: str, reason: str) -> dict[str, Any]:
    """The campaign as its GET shows it, as far as its worker has said it. Any: JSON."""
    known = {"id": campaign_id, "rig": line.place.address, "state": "running", "asked": wish, "reason": reason}
    if line.campaign.get("id") != campaign_id:
        return known
    try:
        whole = summary(with_progress(line.campaign, line.state, Asked(wish))).model_dump(mode="json")
    except Exception:  # a fault of this program: the rig was stopped, and whoever did it must hear that
        LOG.exception("campaign %s could not be shown", campaign_id)
        return known
    return {**whole, "reason": reason}


async def past_worker(address: str) -> dict[str, Any]:
    """Stop a rig over the wire, in a thread of its own; returns what `make_safe` says. Any: JSON."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[dict[str, Any]] = loop.create_future()

    def told(safe: dict[str, Any]) -> None:
        if not done.done():  # the client has gone
            done.set_result(safe)

    def send() -> None:
        safe = make_safe(address)
        if not loop.is_closed():
            loop.call_soon_threadsafe(told, safe)

    Thread(target=send, name="stop", daemon=True).start()
    return await done


class StopLayer:
    """ASGI: answers stops, and hands everything else on. Who may stop a rig is decided before a request comes here."""

    def __init__(self, app: ASGIApp, stops: Stops) -> None:
        self.app, self.stops = app, stops

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "POST":
            answer = await self._answer(scope)
            if answer is not None:
                await _send(scope, send, *answer)
                return
        await self.app(scope, receive, send)

    async def _answer(self, scope: Scope) -> Answer | None:
        if campaign := _CAMPAIGN.fullmatch(scope["path"]):
            return await self.stops.campaign(campaign[1], campaign[2], _by(scope))
        if rig := _RIG.fullmatch(scope["path"]):
            found = self.stops.rig_called(rig[1])
            return None if found is None else await self.stops.rig(*found, rig[2], _by(scope))
        return None


def _by(scope: Scope) -> str:
    person = scope.get("state", {}).get("person", "")
    return f" by {person}" if person else ""


async def _send(scope: Scope, send: Send, status: int, body: dict[str, Any]) -> None:
    if status >= 400:
        await send_problem(scope, send, status, body["detail"])
        return
    content = json.dumps(body).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(content)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": content})
