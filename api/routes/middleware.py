"""Checks of every body: its size, and that its JSON is JSON."""

from __future__ import annotations

from asyncio import to_thread

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.errors import one_line
from api.findings import Refused
from api.problems import problem, send_problem
from api.routes.strict_json import NotJson, check_json
from api.routes.strict_request import is_json

__all__ = ["BodyLimit", "body_first"]

_READS = ("GET", "HEAD", "OPTIONS")
_LARGE_BYTES = 2**16  # checked in less than a millisecond


class BodyLimit:
    """Refuses a body above ``most_bytes`` with 413, with or without a stated length, and what only looks like JSON.

    The routes of ``streamed`` paths limit the size themselves and hold nothing in memory.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, streamed: tuple[str, ...] = ()) -> None:
        self.app, self.most_bytes, self.streamed = app, most_bytes, streamed

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in _READS or scope["path"] in self.streamed:
            await self.app(scope, receive, send)
            return
        body = bytearray()
        more = True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            body += message.get("body", b"")
            more = message.get("more_body", False)
            if len(body) > self.most_bytes:
                await send_problem(scope, send, 413, f"body is larger than {self.most_bytes} bytes: split the campaign")
                return
        if body and is_json(Headers(scope=scope).get("content-type", "")):
            try:
                await _checked(bytes(body))
            except (NotJson, Refused) as error:
                status, found = (422, error.findings) if isinstance(error, Refused) else (400, ())
                await problem(status, one_line(error), scope, errors=found)(scope, receive, send)
                return
        whole = {"type": "http.request", "body": bytes(body), "more_body": False}
        await self.app(scope, body_first(whole, receive), send)


async def _checked(body: bytes) -> None:
    """Check a body; a large one in a thread, so that other requests are answered meanwhile."""
    if len(body) < _LARGE_BYTES:
        check_json(body)
    else:
        await to_thread(check_json, body)


def body_first(whole: Message, then: Receive) -> Receive:
    """A receive that returns the whole body first, then what ``then`` receives."""
    given = False

    async def next_message() -> Message:
        nonlocal given
        if given:
            return await then()
        given = True
        return whole

    return next_message
