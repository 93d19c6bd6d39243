"""The app of the service: its routes, error handlers and workers."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import FastAPI
from fastapi.concurrency import run_in_threadpool

from api.campaigns.worker import Workers
from api.jobs.worker import JobWorker
from api.routes import campaigns, docs, explanations, health, jobs, live, page, rigs, runs
from api.routes.middleware import BodyLimit, SameOrigin
from api.routes.refusals import answer_errors
from api.service import open_service
from api.settings import Settings

__all__ = ["create_app"]


def create_app(settings: Settings, *, with_workers: bool = True) -> FastAPI:
    """The app; its store and its workers start with it, not before.

    ``with_workers=False``: campaigns and jobs are only accepted; the workers run elsewhere.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        service = await run_in_threadpool(open_service, settings)
        workers = Workers(service.database, service.runs, service.live, settings)
        job_worker = JobWorker(service.database, service.runs, service.results, settings)
        app.state.service = service
        app.state.late = ()
        if with_workers:
            workers.start()
            job_worker.start()
        try:
            yield
        finally:
            service.closing.set()
            if with_workers:
                app.state.late = await run_in_threadpool(workers.stop)
                await run_in_threadpool(job_worker.stop)
            service.database.close()

    app = FastAPI(title="damper-rig", version=version("damper-rig"), lifespan=lifespan, docs_url=None, redoc_url=None)
    for routes in (campaigns, rigs, runs, jobs, explanations, health, live, page, docs):
        app.include_router(routes.router)
    answer_errors(app)
    app.add_middleware(SameOrigin)
    app.add_middleware(BodyLimit, most_bytes=4 * 2**20, streamed=("/v1/runs",))
    return app
