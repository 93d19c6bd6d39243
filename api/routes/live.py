"""Server-sent events: the campaigns, rigs and queues whenever they change, the newest samples, and a heartbeat."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from api.routes.feed import TICK_S, Feed
from api.service import Service, ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/live", tags=["live"])

SLOWEST_S = 10.0  # for a watcher to take what was sent: one that does not is dropped, and connects again when it can


@router.get("", response_class=Response, responses={200: {"content": {"text/event-stream": {}}}})
async def live(service: ServiceDep, request: Request) -> Response:
    """Events as they happen, for a page or a program that looks on.

    ``campaigns``, ``explanations``, ``rigs``: the lists of their GET. ``campaign``: one that has changed. ``progress``:
    of tests that run. ``queues``: by the ids of the rigs. ``samples``: points of the running tests, in order and
    numbered. ``trouble``: the store does not answer. ``beat``: at least every 0.5 s, so that silence means that the
    service is away.
    """
    return EventStream(service, request.app.state.feed)


_TURNS, _TURN_S = 40, 0.005  # 200 watchers: five at a time, which takes 2 ms, within 0.2 s
_FULL_RATE = 150  # watchers that get every tick


class EventStream(Response):
    """Sends the feed until the reader leaves, the service ends, or the reader has taken nothing for ten seconds."""

    media_type = "text/event-stream"

    def __init__(self, service: Service, feed: Feed) -> None:
        super().__init__(headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"})
        del self.headers["content-length"]
        self._service, self._feed = service, feed

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
        self._feed.watchers += 1
        place = self._feed.watchers
        gone = asyncio.ensure_future(_left(receive))
        try:
            tick, text = self._feed.begin()
            while not self._service.closing.is_set() and not gone.done():
                async with asyncio.timeout(SLOWEST_S):
                    await send({"type": "http.response.body", "body": text, "more_body": True})
                tick, text = await self._feed.after(tick)  # at the latest with the next heartbeat
                if (turn_s := _turn_s(place, self._feed.watchers)) > 0:
                    await asyncio.sleep(turn_s)
            if not gone.done():
                await send({"type": "http.response.body", "body": b"", "more_body": False})
        except TimeoutError:
            pass  # the server closes the connection; what waited for it was one message
        finally:
            self._feed.watchers -= 1
            gone.cancel()


def _turn_s(place: int, watchers: int) -> float:
    """How long a watcher waits after a tick: a stop that comes meanwhile waits for a few of them, and not for all.

    Hundreds of them also get two ticks at once, or three: their work has a limit.
    """
    return (place - 1) % _TURNS * _TURN_S + watchers // _FULL_RATE * TICK_S if watchers > 1 else 0.0


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
