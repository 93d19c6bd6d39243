"""Figures of the service in the text format of Prometheus; no label has a value that a client chooses."""

from __future__ import annotations

import time
from collections.abc import Iterable

from fastapi import APIRouter, Request, Response
from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.service import Service, ServiceDep
from api.store.counts import count_store

__all__ = ["Measured", "RequestFigures", "router"]

router = APIRouter(tags=["health"])

_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
_SECONDS = (0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0, 30.0)  # 0.2 s: what a stop may take


class RequestFigures:
    """Requests of one app by method, route template and status, and how long they took."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        labels = ("method", "route", "status")
        self.count = Counter("damper_rig_requests", "Requests answered.", labels, registry=self.registry)
        self.seconds = Histogram(
            "damper_rig_request_seconds",
            "Time until the answer began.",
            ("method", "route"),
            buckets=_SECONDS,
            registry=self.registry,
        )

    def note(self, scope: Scope, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "") or "none"  # the template: as many as there are routes
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self.count.labels(method, route, str(status)).inc()
        self.seconds.labels(method, route).observe(seconds)


class Measured:
    """Counts every request."""

    def __init__(self, app: ASGIApp, figures: RequestFigures) -> None:
        self.app, self.figures = app, figures

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began = time.perf_counter()

        async def noted(message: Message) -> None:
            if message["type"] == "http.response.start":
                self.figures.note(scope, message["status"], time.perf_counter() - began)
            await send(message)

        await self.app(scope, receive, noted)


class _StoreFigures(Collector):
    """What the store holds, counted when it is asked for."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def collect(self) -> Iterable[Metric]:
        found = count_store(self._service.database)
        for name, text, label, values in (
            ("damper_rig_campaigns", "Campaigns.", "state", found.campaigns),
            ("damper_rig_queue_length", "Campaigns that wait.", "rig", found.queues),
            ("damper_rig_queue_paused", "1: nothing starts on this rig.", "rig", found.paused),
            ("damper_rig_jobs", "Jobs.", "state", found.jobs),
        ):
            family = GaugeMetricFamily(name, text, labels=[label])
            for value, number in values.items():
                family.add_metric([value], number)
            yield family
        yield _fifo(self._service, found.queues)
        yield GaugeMetricFamily(
            "damper_rig_run_bytes", "Size of all run files.", value=self._service.runs.total_bytes()
        )


def _fifo(service: Service, registered: Iterable[str]) -> Metric:
    """How full the FIFO of each registered rig is on which a test is streamed, as its worker said it last."""
    text = "Share of the rig's FIFO that is full, of the test that is streamed."
    family = GaugeMetricFamily("damper_rig_fifo_ratio", text, labels=["rig"])
    for rig in registered:
        line = service.lines.lines.get(rig)
        if line is None or not line.open or "test" not in line.state:
            continue
        fifo = line.state.get("fifo")
        if isinstance(fifo, float):
            family.add_metric([rig], fifo)
    return family


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(request: Request, service: ServiceDep) -> Response:
    """Figures for monitoring, in the text format of Prometheus."""
    store = CollectorRegistry()
    store.register(_StoreFigures(service))
    text = generate_latest(request.app.state.figures.registry) + generate_latest(store)
    return Response(text, headers={"content-type": CONTENT_TYPE_LATEST})
