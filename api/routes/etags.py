"""ETags of everything that is read: 304 where the client has it already, 412 where it changes what it has not seen."""

from __future__ import annotations

import hashlib
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.problems import send_problem

__all__ = ["ETags"]

_CHANGES = ("DELETE", "PUT")
_KEPT_BY_304 = ("etag", "link", "cache-control", "vary", "content-location", "expires", "date")


class ETags:
    """Adds an ETag to every JSON answer below /v1, answers If-None-Match, and refuses a change by If-Match.

    The ETag of a record is that of its JSON; files bring their own. A DELETE or PUT with If-Match is compared with what
    GET answers at the same address.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not scope["path"].startswith("/v1/") or scope["path"].startswith("/v1/live"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if scope["method"] == "GET":
            await self._read(scope, receive, send, headers.get("if-none-match", ""))
            return
        wanted = headers.get("if-match", "") if scope["method"] in _CHANGES else ""
        if wanted and not _matches(wanted, await self._current(scope), weak=False):
            await send_problem(scope, send, 412, "it has changed since it was read, or is gone: read it again")
            return
        await self.app(scope, receive, send)

    async def _read(self, scope: Scope, receive: Receive, send: Send, known: str) -> None:
        answer = _Answer(send, known)
        await self.app(scope, receive, answer.send)

    async def _current(self, scope: Scope) -> str:
        """The ETag that GET answers at this address; empty where there is nothing."""
        found: list[str] = []

        async def note(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] == 200:
                found.append(Headers(raw=message["headers"]).get("etag", ""))

        async def no_body() -> Message:
            return {"type": "http.request", "body": b"", "more_body": False}

        left_out = (b"if-match", b"content-length", b"content-type", b"transfer-encoding")
        kept = [(name, value) for name, value in scope["headers"] if name not in left_out]
        reads = {**scope, "method": "GET", "headers": kept, "query_string": b"", "state": dict(scope.get("state", {}))}
        await self._read(reads, no_body, note, "")
        return found[0] if found else ""


class _Answer:
    """Holds a JSON answer back until its ETag is known; lets every other answer through."""

    def __init__(self, send: Send, known: str) -> None:
        self._send, self._known = send, known
        self._start: dict[str, Any] | None = None  # a message of ASGI that is held back
        self._body = bytearray()
        self._dropped = False

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            await self._begin(message)
        elif self._dropped:
            return
        elif self._start is None:
            await self._send(message)
        else:
            self._body += message.get("body", b"")
            if not message.get("more_body", False):
                await self._end(self._start)

    async def _begin(self, message: Message) -> None:
        headers = Headers(raw=message["headers"])
        if message["status"] == 200 and "etag" in headers and _matches(self._known, headers["etag"], weak=True):
            await self._not_modified(message["headers"])
        elif message["status"] == 200 and "etag" not in headers and headers.get("content-type") == "application/json":
            self._start = dict(message)
        else:
            await self._send(message)

    async def _end(self, start: dict[str, Any]) -> None:
        headers = MutableHeaders(raw=list(start["headers"]))
        headers["ETag"] = f'"{hashlib.sha256(self._body).hexdigest()[:32]}"'
        headers.setdefault("Cache-Control", "no-cache")  # kept by the client, asked for again each time
        if _matches(self._known, headers["etag"], weak=True):
            await self._not_modified(headers.raw)
            return
        await self._send({**start, "headers": headers.raw})
        await self._send({"type": "http.response.body", "body": bytes(self._body)})

    async def _not_modified(self, headers: list[tuple[bytes, bytes]]) -> None:
        kept = [(name, value) for name, value in headers if name.decode().lower() in _KEPT_BY_304]
        self._dropped = True
        await self._send({"type": "http.response.start", "status": 304, "headers": kept})
        await self._send({"type": "http.response.body", "body": b""})


def _matches(given: str, etag: str, *, weak: bool) -> bool:
    """Whether a list of ETags has this one; weakly: without regard to W/ (RFC 9110, 8.8.3.2)."""
    if given.strip() == "*":
        return bool(etag)
    listed = [one.strip() for one in given.split(",")]
    if weak:
        return etag.removeprefix("W/") in [one.removeprefix("W/") for one in listed]
    return bool(etag) and not etag.startswith("W/") and etag in listed
