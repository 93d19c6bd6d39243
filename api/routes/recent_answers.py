"""Status answers that many ask for at once are made once: each is given again for a tenth of a second.

Whoever changes something through this process reads the change at once. What a worker process or another service writes
is seen up to ``KEPT_S`` later, which is half of the interval at which workers tell their progress. Whoever has seen it
in one answer sees it in all others: an answer that has changed ends the life of every older one.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["KEPT_S", "RecentAnswers"]

KEPT_S = 0.1
_SAME_FOR_ALL = ("/v1/campaigns", "/v1/rigs", "/v1/jobs", "/v1/explanations")  # whoever may read them
_MOST_KEPT = 256
_LARGEST = 256 * 1024  # bytes of an answer
_READS = ("GET", "HEAD", "OPTIONS")


@dataclass(slots=True)
class _Recent:
    """An answer that is being made, or was made; no messages: it is not given to others."""

    generation: int
    made: asyncio.Event = field(default_factory=asyncio.Event)
    until_s: float = 0.0
    messages: tuple[Message, ...] = ()


class RecentAnswers:
    """Gives JSON answers again. It stands inside of access control: every request was let through already."""

    def __init__(self, app: ASGIApp, clock: Callable[[], float] = time.monotonic) -> None:
        self.app, self._clock = app, clock
        self._generation = 0  # rises with everything that this process changes, or finds changed
        self._recent: dict[tuple[str, bytes, str], _Recent] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
        elif scope["method"] not in _READS:
            await self._change(scope, receive, send)
        elif scope["method"] == "GET" and scope["path"].startswith(_SAME_FOR_ALL):
            await self._read(scope, receive, send)
        else:
            await self.app(scope, receive, send)

    async def _change(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def noting(message: Message) -> None:
            self._generation += 1  # before the answer: whoever has it reads what it says
            await send(message)

        try:
            await self.app(scope, receive, noting)
        finally:
            self._generation += 1  # also where nobody waited for the answer

    async def _read(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        if "range" in headers:
            await self.app(scope, receive, send)
            return
        key = (scope["path"], scope["query_string"], headers.get("if-none-match", ""))
        one = self._recent.get(key)
        if one is None or one.generation != self._generation or (one.made.is_set() and self._clock() >= one.until_s):
            await self._make(key, scope, receive, send)
            return
        await one.made.wait()
        if not one.messages:
            await self.app(scope, receive, send)
        for message in one.messages:
            await send(_copy(message))

    async def _make(self, key: tuple[str, bytes, str], scope: Scope, receive: Receive, send: Send) -> None:
        one = _Recent(self._generation)
        former = self._recent.pop(key, None)
        while len(self._recent) >= _MOST_KEPT:
            del self._recent[next(iter(self._recent))]
        self._recent[key] = one
        seen: list[Message] = []
        size = 0

        async def keeping(message: Message) -> None:
            nonlocal size
            size += len(message.get("body", b""))
            if not one.made.is_set():
                seen.append(_copy(message))
                if size > _LARGEST or not _may_be_kept(seen[0]):
                    self._give_up(key, one)  # nobody waits for a file
                elif message["type"] == "http.response.body" and not message.get("more_body", False):
                    one.messages, one.until_s = tuple(seen), self._clock() + KEPT_S
                    if one.generation == self._generation and (former is None or _body(former) != _body(one)):
                        self._generation += 1
                        one.generation = self._generation
                    one.made.set()  # before it is sent: nobody waits for a slow reader
            await send(message)

        try:
            await self.app(scope, receive, keeping)
        finally:
            if not one.made.is_set():
                self._give_up(key, one)

    def _give_up(self, key: tuple[str, bytes, str], one: _Recent) -> None:
        one.made.set()
        if self._recent.get(key) is one:
            del self._recent[key]


def _body(one: _Recent) -> bytes:
    return b"".join(message.get("body", b"") for message in one.messages)


def _may_be_kept(start: Message) -> bool:
    """Whether an answer that begins so is JSON, or a 304."""
    kind = Headers(raw=start["headers"]).get("content-type", "")
    status = start["status"]
    return bool(status == 304 or (status == 200 and kind == "application/json"))


def _copy(message: Message) -> dict[str, Any]:
    """A message whose headers others may change. Any: ASGI's own dictionary."""
    return {**message, "headers": list(message["headers"])} if "headers" in message else dict(message)
