"""A status that many ask for at once is read once, and whoever changes something reads the change at once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Response

from api.routes.recent_answers import KEPT_S, RecentAnswers
from tests.api.following import get, post


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


class Served:
    """An app whose one campaign counts how often it was read."""

    def __init__(self) -> None:
        self.reads = 0
        self.clock = Clock()
        self.go_on = asyncio.Event()
        self.go_on.set()
        self.state = "running"
        app = FastAPI()

        @app.get("/v1/rigs")
        async def rigs() -> str:
            return self.state

        @app.get("/v1/campaigns/one")
        async def one() -> str:
            self.reads += 1
            return self.state

        @app.get("/v1/campaigns")
        async def read() -> dict[str, int]:
            self.reads += 1
            number = self.reads
            await self.go_on.wait()
            return {"read": number}

        @app.get("/v1/campaigns/file")
        async def file() -> Response:
            self.reads += 1
            return Response(b"x", media_type="application/x-hdf5")

        @app.post("/v1/campaigns")
        async def change() -> None:
            pass

        self.client = httpx.AsyncClient(
            transport=httpx.ASGITransport(RecentAnswers(app, self.clock)), base_url="http://127.0.0.1"
        )

    async def read(self, path: str = "/v1/campaigns", **headers: str) -> Any:
        return (await self.client.get(path, headers=headers)).json()


def served(steps: Callable[[Served], Any]) -> None:
    async def run() -> None:
        one = Served()
        async with one.client:
            await asyncio.wait_for(steps(one), 60)

    asyncio.run(run())


def test_an_answer_is_given_again_for_a_moment_and_then_made_anew() -> None:
    async def steps(one: Served) -> None:
        assert await one.read() == await one.read() == {"read": 1}
        one.clock.now_s += KEPT_S
        assert await one.read() == {"read": 2}
        assert await one.read("/v1/campaigns?limit=1") == {"read": 3}  # another question

    served(steps)


def test_who_has_read_a_change_in_one_answer_reads_it_in_all() -> None:
    async def steps(one: Served) -> None:
        assert [await one.read("/v1/campaigns/one"), await one.read("/v1/rigs")] == ["running"] * 2
        one.clock.now_s += KEPT_S / 2
        one.state = "failed"  # by a worker
        assert await one.read("/v1/rigs") == "running"
        one.clock.now_s += KEPT_S / 2
        assert await one.read("/v1/rigs?once=more") == "failed"
        assert [await one.read("/v1/campaigns/one"), await one.read("/v1/rigs")] == ["failed"] * 2

    served(steps)


def test_what_has_not_changed_is_not_read_more_often() -> None:
    async def steps(one: Served) -> None:
        for _ in range(3):
            assert [await one.read("/v1/campaigns/one"), await one.read("/v1/rigs")] == ["running"] * 2
        assert one.reads == 2  # the first answer to another question may say something new
        one.clock.now_s += KEPT_S
        for _ in range(3):
            assert [await one.read("/v1/campaigns/one"), await one.read("/v1/rigs")] == ["running"] * 2
        assert one.reads == 3

    served(steps)


def test_many_who_ask_at_once_wait_for_one_answer() -> None:
    async def steps(one: Served) -> None:
        one.go_on.clear()
        asked = [asyncio.create_task(one.read()) for _ in range(50)]
        while not one.reads:
            await asyncio.sleep(0)
        one.go_on.set()
        assert await asyncio.gather(*asked) == [{"read": 1}] * 50

    served(steps)


def test_who_asks_after_a_change_never_gets_an_answer_from_before() -> None:
    async def steps(one: Served) -> None:
        one.go_on.clear()
        before = asyncio.create_task(one.read())
        while not one.reads:
            await asyncio.sleep(0)
        await one.client.post("/v1/campaigns")
        after = asyncio.create_task(one.read())
        while one.reads < 2:
            await asyncio.sleep(0)
        one.go_on.set()
        assert (await before, await after) == ({"read": 1}, {"read": 2})
        assert await one.read() == {"read": 2}

    served(steps)


def test_an_asker_who_goes_away_leaves_nobody_waiting() -> None:
    async def steps(one: Served) -> None:
        one.go_on.clear()
        first = asyncio.create_task(one.read())
        while not one.reads:
            await asyncio.sleep(0)
        second = asyncio.create_task(one.read())
        await asyncio.sleep(0)
        first.cancel()
        with pytest.raises(asyncio.CancelledError):
            await first
        one.go_on.set()
        assert await second == {"read": 2}

    served(steps)


def test_files_and_ranges_are_not_kept() -> None:
    async def steps(one: Served) -> None:
        for _ in range(2):
            await one.client.get("/v1/campaigns/file")
            await one.read(range="bytes=0-")
        assert one.reads == 4

    served(steps)


def test_a_client_reads_what_it_has_just_changed(base: str, body: dict[str, Any]) -> None:
    for _ in range(5):
        made = post(base, {**body, "rig": "modbus://127.0.0.1:9"})["id"]
        assert get(base, "/v1/campaigns?limit=1")["campaigns"][0]["id"] == made
