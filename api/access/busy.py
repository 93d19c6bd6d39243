"""What is being answered on which connection, and how much of it at once."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.access.connections import Connections, Peer
from api.errors import TOO_MANY_OPEN
from api.problems import send_problem

__all__ = ["RESERVE", "BodyPace", "Busy", "Tracked"]

RESERVE = 64  # places for connections that only lasting requests may not fill: for a stop, and for short requests


class Tracked:
    """Tells the connections when a request begins and ends; the outermost layer, so that peers are not rewritten."""

    def __init__(self, app: ASGIApp, connections: Connections) -> None:
        self.app, self.connections = app, connections

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        client = scope.get("client")
        if scope["type"] != "http" or not client:
            await self.app(scope, receive, send)
            return
        peer: Peer = (client[0], client[1])
        self.connections.begins(peer)

        async def watched(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] not in (401, 403, 421, 429):
                self.connections.is_known(peer)
            await send(message)

        try:
            await self.app(scope, receive, watched)
        finally:
            self.connections.ends(peer)


class Busy:
    """Refuses requests with 503 while ``most`` are being answered, or descriptors are scarce; never those that stop."""

    def __init__(
        self, app: ASGIApp, most: int, never: Callable[[str, str], bool], scarce: Callable[[], bool] = lambda: False
    ) -> None:
        """``never``: whether a method and a path are never refused; ``scarce``: whether no file can be opened."""
        self.app, self.most, self.never, self.scarce, self.now = app, most, never, scarce, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or self.never(scope["method"], scope["path"]):
            await self.app(scope, receive, send)
            return
        if self.scarce():  # its descriptor may be the last one: it is wanted back
            await send_problem(scope, send, 503, TOO_MANY_OPEN, headers={"Connection": "close"})
            return
        if self.now >= self.most:
            await send_problem(scope, send, 503, f"{self.now} requests are being answered: try again")
            return
        self.now += 1
        try:
            await self.app(scope, receive, send)
        finally:
            self.now -= 1


class BodyPace:
    """Ends requests whose body comes too slowly, as if their sender had gone.

    A body has ``grace_s``, and then as long as it comes with ``least_bytes_per_s`` on average. Only the time in which
    somebody waits for it counts, not that in which the service is busy with something else.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        grace_s: float,
        least_bytes_per_s: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.app, self.grace_s, self.least, self.clock = app, grace_s, least_bytes_per_s, clock

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        waited_s, read, whole = 0.0, 0, False

        async def paced() -> Message:
            nonlocal waited_s, read, whole
            if whole:  # only the end of the connection is waited for
                return await receive()
            begun_s = self.clock()
            try:
                async with asyncio.timeout(self.grace_s + read / self.least - waited_s):
                    message = await receive()
            except TimeoutError:
                whole = True
                return {"type": "http.disconnect"}
            finally:
                waited_s += self.clock() - begun_s
            read += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            return message

        await self.app(scope, paced, send)
