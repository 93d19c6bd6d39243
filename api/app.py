"""The service: routes, errors and the workers, wired together for one app."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import fields
from importlib.metadata import version
from typing import Any

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from api.campaigns.live import Live
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.store import Store
from api.campaigns.worker import Workers
from api.errors import OUTCOMES, one_line, outcome_of
from api.jobs.explain import NewExplanation
from api.jobs.results import Reports
from api.jobs.store import ExplanationStore
from api.jobs.worker import Explainer
from api.routes import campaigns, docs, explanations, health, live, page, rigs, runs
from api.routes.middleware import BodyLimit, SameOrigin
from api.service import House
from api.settings import Settings
from api.store.runs import RunFiles

__all__ = ["create_app"]

LOG = logging.getLogger("damper_rig.service")


def create_app(settings: Settings, *, with_workers: bool = True) -> FastAPI:
    """The app; its store is opened and its workers are started when it starts, not before.

    ``with_workers=False``: campaigns and explanations are accepted here and worked on elsewhere.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        store = await run_in_threadpool(Store, settings.store_url)
        house = House(
            settings=settings,
            store=store,
            explanations=ExplanationStore(store),
            files=RunFiles(settings.runs_dir.absolute()),
            reports=Reports(settings.reports_dir.absolute()),
            live=Live(),
        )
        workers = Workers(store, house.files, house.live, settings)
        explainer = Explainer(house.explanations, house.files, house.reports, settings)
        app.state.house = house
        app.state.late = ()
        if with_workers:
            workers.start()
            explainer.start()
        try:
            yield
        finally:
            house.closing.set()
            if with_workers:
                app.state.late = await run_in_threadpool(workers.stop)
                await run_in_threadpool(explainer.stop)
            store.close()

    app = FastAPI(title="damper-rig", version=version("damper-rig"), lifespan=lifespan, docs_url=None, redoc_url=None)
    for routes in (campaigns, rigs, runs, explanations, health, live, page, docs):
        app.include_router(routes.router)
    for kind in {kind for kind, _ in OUTCOMES}:
        app.add_exception_handler(kind, _ours)
    app.add_exception_handler(RequestValidationError, _refused)
    app.add_exception_handler(HTTPException, _http)
    app.add_middleware(SameOrigin)
    app.add_middleware(BodyLimit, most_bytes=4 * 2**20, streamed=("/v1/runs",))
    return app


async def _ours(request: Request, error: Exception) -> JSONResponse:
    outcome = outcome_of(error)
    assert outcome is not None  # only errors of the table come here
    if outcome.http_status >= 500:
        LOG.error("%s %s: %s", request.method, request.url.path, one_line(error))
    return JSONResponse({"detail": one_line(error)}, status_code=outcome.http_status)


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    detail = " ".join(str(error.detail).split())
    if error.status_code in (404, 405):
        detail = f"{request.method} {ascii(request.url.path)[1:-1]:.80}: {detail}; /docs lists what there is"
    return JSONResponse({"detail": detail}, status_code=error.status_code, headers=error.headers)


async def _refused(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    status = 400 if first["type"] == "json_invalid" else 422
    return JSONResponse({"detail": refusal(first, len(error.errors()), _keys(request.url.path))}, status_code=status)


def _keys(path: str) -> str:
    kind = NewExplanation if path.startswith("/v1/explanations") else NewCampaign
    return ", ".join(key.name for key in fields(kind))


def refusal(error: dict[str, Any], count: int, known: str) -> str:
    """One line for what pydantic found: where, the value, what would be right. Any: pydantic's own dictionary."""
    where = _place(error["loc"])
    more = f" ({count - 1} more)" if count > 1 else ""
    if error["type"] == "json_invalid":
        return f"{where}: not JSON: {error.get('ctx', {}).get('error', error['msg'])}"
    if error["type"] == "missing":
        return f"{where} is missing: add it{more}"
    if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{where} is not a known key: known are {known}{more}"
    if error["type"] == "value_error":  # one of ours: it says everything itself
        return one_line(error["ctx"]["error"])
    return f"{where} is {_shown(error['input'])}: {error['msg'].replace('Input should', 'it must', 1)}{more}"


def _place(loc: Sequence[int | str]) -> str:
    parts = [ascii(part)[1:-1][:40] if isinstance(part, str) else str(part) for part in loc]
    return ".".join(parts) or "body"


def _shown(value: object) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."
