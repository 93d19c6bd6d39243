"""Server-sent events: the campaigns whenever they change, and the newest samples of the running tests."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import asdict

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse

from api.errors import StoreError, one_line
from api.routes.answers import CampaignList, ExplanationList, explanation_answer, summary
from api.service import Service, ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/live", tags=["live"])

_INTERVAL_S = 0.25
_SHOWN = 20
_SILENT_INTERVALS = 40  # then a comment keeps the connection open through proxies


@router.get("", response_class=StreamingResponse)
async def live(service: ServiceDep, request: Request) -> StreamingResponse:
    """Events ``campaigns`` and ``explanations`` (the lists of their GET), ``samples`` (new blocks) and ``trouble``."""
    return StreamingResponse(
        _events(service, request), media_type="text/event-stream", headers={"Cache-Control": "no-store"}
    )


async def _events(service: Service, request: Request) -> AsyncIterator[str]:
    shown, number, silent = ("", ""), 0, 0
    while not service.closing.is_set() and not await request.is_disconnected():
        news = await run_in_threadpool(_news, service)
        blocks = service.live.after(number)
        for now, before in zip(news, shown, strict=True):
            if now and now != before:
                yield now
        if blocks:
            yield _event("samples", [asdict(block) for block in blocks])
            number = blocks[-1].number
        silent = 0 if blocks or news != shown else silent + 1
        if silent >= _SILENT_INTERVALS:
            yield ": still here\n\n"
            silent = 0
        shown = news
        await asyncio.sleep(_INTERVAL_S)


def _news(service: Service) -> tuple[str, str]:
    try:
        found = service.campaigns.campaigns(limit=_SHOWN)
        explained = service.explanations.newest(limit=_SHOWN)
    except StoreError as error:
        return _event("trouble", {"detail": one_line(error)}), ""
    answer = CampaignList(campaigns=[summary(campaign) for campaign in found], next_before=None)
    others = ExplanationList(explanations=[explanation_answer(one) for one in explained], next_before=None)
    return (
        _event("campaigns", answer.model_dump(mode="json")),
        _event("explanations", others.model_dump(mode="json")),
    )


def _event(name: str, data: object) -> str:
    return f"event: {name}\ndata: {json.dumps(data)}\n\n"
