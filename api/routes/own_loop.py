"""Event loops for requests with a body, beside the one that stops rigs."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from functools import partial
from threading import Thread

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.routes.crossing import Crossing
from api.routes.middleware import body_first

__all__ = ["OwnLoop"]

_READS = ("GET", "HEAD", "OPTIONS")


class OwnLoop:
    """Answers requests with a body in an event loop of its own, so that no body that is parsed delays a stop.

    Parsing and checking a body takes up to some 0.1 s of a processor, and nothing else runs in its loop meanwhile. The
    answers to such requests are short: they are collected whole. The routes of ``streamed`` paths stay where they are.
    Checking the tests of ``designing`` paths takes minutes where there are many: these have their own loop, so that
    hold, resume and pause do not wait for it.
    """

    def __init__(self, app: ASGIApp, streamed: tuple[str, ...] = (), designing: tuple[str, ...] = ()) -> None:
        self.app, self.streamed, self.designing = app, streamed, designing
        self._ways: dict[str, Crossing] = {}
        self._back: Crossing | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in _READS or scope["path"] in self.streamed:
            await self.app(scope, receive, send)
            return
        first = await receive()
        asked = _Asked(self.app, scope, first, self._way_back())
        there = self._way_there(scope["path"])
        there.call(asked.begin)
        try:
            messages = await asked.answer
        except asyncio.CancelledError:
            there.call(asked.cancel)
            raise
        for message in messages:
            await send(message)

    def _way_there(self, path: str) -> Crossing:
        """Into the loop of a path, which runs in a thread that ends with the process."""
        name = "designs" if path in self.designing else "bodies"
        if name not in self._ways:
            self._ways[name] = Crossing(asyncio.new_event_loop())
            Thread(target=self._ways[name].loop.run_forever, name=name, daemon=True).start()
        return self._ways[name]

    def _way_back(self) -> Crossing:
        here = asyncio.get_running_loop()
        if self._back is None or self._back.loop is not here:
            self._back = Crossing(here)
        return self._back


class _Asked:
    """A request that is answered in the other loop."""

    def __init__(self, app: ASGIApp, scope: Scope, first: Message, back: Crossing) -> None:
        self._app, self._scope, self._first, self._back = app, scope, first, back
        self.answer: asyncio.Future[list[Message]] = back.loop.create_future()
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """In the other loop."""
        self._task = asyncio.get_running_loop().create_task(self._run())

    def cancel(self) -> None:
        """In the other loop: nobody waits for the answer any more."""
        if self._task is not None:
            self._task.cancel()

    async def _run(self) -> None:
        messages: list[Message] = []

        async def keep(message: Message) -> None:
            messages.append(message)

        error: BaseException | None = None
        try:
            await self._app(self._scope, body_first(self._first, _never), keep)
        except BaseException as raised:  # noqa: BLE001 - whatever it was, it is raised where the request came in
            error = raised
        with suppress(RuntimeError):  # the loop that asked was closed meanwhile: nobody waits for the answer
            self._back.call(partial(self._tell, messages, error))

    def _tell(self, messages: list[Message], error: BaseException | None) -> None:
        if self.answer.cancelled():
            return
        if error is not None:
            self.answer.set_exception(error)
        else:
            self.answer.set_result(messages)


async def _never() -> Message:
    """The next message of a connection from which nothing is awaited any more."""
    await asyncio.Event().wait()
    return {"type": "http.disconnect"}
