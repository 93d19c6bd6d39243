"""The app of the service: its routes, error handlers and workers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from importlib.metadata import version

from fastapi import Depends, FastAPI
from fastapi.concurrency import run_in_threadpool

from api.access.access import Access
from api.access.connections import Connections
from api.access.layers import protect
from api.campaigns.live import Live
from api.campaigns.supervisor import Supervisor
from api.jobs.worker import JobWorker
from api.line.service_end import ServiceEnd
from api.problems import problem_answers
from api.routes import access as access_routes
from api.routes import (
    campaigns,
    designs,
    docs,
    drawings,
    explanations,
    health,
    jobs,
    live,
    metrics,
    models,
    page,
    rigs,
    run_list,
    runs,
)
from api.routes.etags import ETags
from api.routes.feed import Feed
from api.routes.metrics import Measured, RequestFigures
from api.routes.middleware import BodyLimit
from api.routes.openapi import describe
from api.routes.own_loop import OwnLoop
from api.routes.recent_answers import RecentAnswers
from api.routes.refusals import answer_errors
from api.routes.stops import StopLayer, Stops
from api.routes.strict_request import refuse_what_is_not_read
from api.service import open_service
from api.settings import Settings

__all__ = ["create_app"]

_STREAMED = ("/v1/runs", "/v1/designs/file")  # routes that limit and store what they are sent themselves
_DESIGNING = ("/v1/campaigns", "/v1/campaigns/check", "/v1/tests/draw", "/v1/designs")  # their tests are designed
MOST_BODY_BYTES = 2**20  # of JSON: the largest campaign of the tests has 0.2 MB; 1 MB is parsed in 0.02 s


def create_app(settings: Settings, *, with_workers: bool = True, connections: Connections | None = None) -> FastAPI:
    """The app; its store and its workers start with it, not before.

    ``with_workers=False``: campaigns and jobs are only accepted; the workers run elsewhere.
    ``connections``: those of the socket on which it is served, which keep descriptors for a stop.
    """
    samples = Live()
    lines = ServiceEnd(settings.lines_dir, on_live=samples.publish)
    stops = Stops(lines, spares=None if connections is None else connections.spares)
    access = Access.of(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        service = await run_in_threadpool(open_service, settings, access, lines, samples)
        supervisor = Supervisor(service.database, service.runs, settings, lines, service.restarts)
        lines.on_lost = supervisor.lost
        job_worker = JobWorker(service.database, service.runs, service.results, settings)
        app.state.service, app.state.late = service, ()
        app.state.feed = feed = Feed(service, stops.know)
        tasks = [asyncio.create_task(part.run()) for part in (lines, feed)]
        stops.begin()
        if with_workers:
            await run_in_threadpool(supervisor.start)
            job_worker.start()
        try:
            yield
        finally:
            service.closing.set()
            if with_workers:
                app.state.late = await run_in_threadpool(supervisor.stop)
                await run_in_threadpool(job_worker.stop)
            for task in tasks:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
            await run_in_threadpool(access.close)
            service.database.close()

    app = FastAPI(
        title="damper-rig",
        version=version("damper-rig"),
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,  # a route of docs, which refuses what it does not read like every other
        dependencies=[Depends(refuse_what_is_not_read)],
        responses=problem_answers(
            400, 401, 403, 404, 408, 409, 410, 412, 413, 415, 422, 428, 429, 500, 502, 503, 504, 507
        ),
    )
    for routes in (  # tried in this order
        campaigns,
        designs,
        models,
        run_list,
        drawings,
        metrics,
        rigs,
        runs,
        jobs,
        explanations,
        health,
        live,
        page,
        docs,
        access_routes,
    ):
        app.include_router(routes.router)
    app.openapi = partial(describe, app)  # type: ignore[method-assign]  # as FastAPI documents it
    answer_errors(app, settings)
    app.state.figures = RequestFigures()
    app.state.stops = stops
    app.add_middleware(OwnLoop, streamed=_STREAMED, designing=_DESIGNING)
    app.add_middleware(ETags)
    app.add_middleware(RecentAnswers)
    app.add_middleware(BodyLimit, most_bytes=MOST_BODY_BYTES, streamed=_STREAMED)
    app.add_middleware(StopLayer, stops=stops)  # below who may do it, which is answered from memory; above all else
    protect(app, access, connections)
    app.add_middleware(Measured, figures=app.state.figures)  # outermost: counts what the others refuse
    return app
