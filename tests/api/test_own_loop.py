"""Requests with a body are answered in another event loop, which many of them wake once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from threading import Event, Thread, current_thread
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from api.routes.crossing import Crossing
from api.routes.own_loop import OwnLoop

WITHIN_S = 60.0


class CountingLoop(asyncio.SelectorEventLoop):
    """Counts how often another thread wakes it."""

    wakes = 0

    def call_soon_threadsafe(self, *given: Any, **more: Any) -> asyncio.Handle:
        self.wakes += 1
        return super().call_soon_threadsafe(*given, **more)


@pytest.fixture
def loop() -> Iterator[CountingLoop]:
    made = CountingLoop()
    thread = Thread(target=made.run_forever)
    thread.start()
    yield made
    made.call_soon_threadsafe(made.stop)
    thread.join(WITHIN_S)
    made.close()


def test_what_comes_while_the_loop_is_busy_wakes_it_once_and_is_called_in_order(loop: CountingLoop) -> None:
    into, busy, go_on, done = Crossing(loop), Event(), Event(), Event()
    seen: list[int] = []

    def hold() -> None:
        busy.set()
        assert go_on.wait(WITHIN_S)

    into.call(hold)
    assert busy.wait(WITHIN_S)
    before = loop.wakes
    for k in range(100):
        into.call(lambda k=k: seen.append(k))
    into.call(done.set)
    assert loop.wakes <= before + 1
    go_on.set()
    assert done.wait(WITHIN_S)
    assert seen == list(range(100))


def test_no_call_of_many_threads_is_lost(loop: CountingLoop) -> None:
    into, seen, done = Crossing(loop), [], Event()

    def call() -> None:
        for k in range(500):
            into.call(lambda k=k: seen.append((current_thread().name, k)))

    threads = [Thread(target=call) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(WITHIN_S)
    into.call(done.set)
    assert done.wait(WITHIN_S)
    assert sorted(k for _, k in seen) == sorted(4 * list(range(500)))
    assert len({name for name, _ in seen}) == 1


def post(app: Any, path: str = "/v1/things") -> Callable[[], Any]:
    """A request to an app in an OwnLoop: its messages."""
    layer = OwnLoop(app, designing=("/v1/designs",))

    async def answered() -> list[Message]:
        messages: list[Message] = []

        async def receive() -> Message:
            return {"type": "http.request", "body": b"{}", "more_body": False}

        async def send(message: Message) -> None:
            messages.append(message)

        await layer({"type": "http", "method": "POST", "path": path}, receive, send)
        return messages

    return answered


def test_the_answer_comes_back_from_the_loop_of_its_path() -> None:
    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        body = (await receive())["body"]
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": body + current_thread().name.encode()})

    for path, name in (("/v1/things", b"bodies"), ("/v1/designs", b"designs")):
        assert [one.get("body") for one in asyncio.run(post(app, path)())] == [None, b"{}" + name]


def test_an_error_is_raised_where_the_request_came_in() -> None:
    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asyncio.run(post(app)())


def test_a_request_that_is_given_up_is_given_up_in_the_other_loop_too() -> None:
    begun, ended = Event(), Event()

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async def give_up() -> None:
        task = asyncio.create_task(post(app)())
        while not begun.is_set():
            await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(give_up())
    assert ended.wait(WITHIN_S)
