"""What a monitor reads: whether the service runs, whether it can work, and figures whose labels are limited."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from prometheus_client.parser import text_string_to_metric_families

from api.app import create_app
from api.line.place import Place, write_place
from api.line.worker_end import WorkerEnd
from api.problems import RETRY_AFTER_S
from api.settings import Settings
from tests.api.serving import serving

WITHIN_S = 60.0


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    return Settings(data_dir=tmp_path_factory.mktemp("lab") / "data")


@pytest.fixture(scope="module")
def app(settings: Settings) -> FastAPI:
    return create_app(settings, with_workers=False)


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as client:
        client.timeout = httpx.Timeout(WITHIN_S)
        yield client


def figures(client: httpx.Client, name: str) -> dict[tuple[str, ...], float]:
    """The samples of one name by the values of their labels, as Prometheus' own reader finds them."""
    answer = client.get("/metrics")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/plain")
    families = text_string_to_metric_families(answer.text)
    samples = [sample for family in families for sample in family.samples if sample.name == name]
    return {tuple(sample.labels.values()): sample.value for sample in samples}


def until_figures(
    client: httpx.Client, name: str, holds: Callable[[dict[tuple[str, ...], float]], bool]
) -> dict[tuple[str, ...], float]:
    ends = time.monotonic() + WITHIN_S
    while not holds(found := figures(client, name)):
        assert time.monotonic() < ends, found
        time.sleep(0.02)
    return found


def accepted(client: httpx.Client, body: dict[str, Any]) -> str:
    """The id of the rig of a new campaign."""
    assert client.post("/v1/campaigns", json=body).status_code == 201
    return next(str(rig["id"]) for rig in client.get("/v1/rigs").json()["rigs"] if rig["url"] == body["rig"])


def test_campaigns_queues_and_runs_are_counted(client: httpx.Client, body: dict[str, Any]) -> None:
    before = figures(client, "damper_rig_campaigns").get(("accepted",), 0.0)
    rig = accepted(client, body)
    assert figures(client, "damper_rig_campaigns")["accepted",] == before + 1
    assert figures(client, "damper_rig_queue_length")[rig,] == 1.0
    assert figures(client, "damper_rig_queue_paused")[rig,] == 0.0
    assert client.post(f"/v1/rigs/{rig}/pause", json={"reason": "oil"}).status_code == 200
    assert figures(client, "damper_rig_queue_paused")[rig,] == 1.0
    assert figures(client, "damper_rig_run_bytes") == {(): 0.0}


def test_requests_are_counted_by_route_and_what_a_client_makes_up_is_no_label(client: httpx.Client) -> None:
    for k, method in enumerate(("PROPFIND", "PURGE", "REPORT", "MERGE", "LOCK")):  # what is no method is refused before
        client.get(f"/v1/campaigns/made-up-{k}")
        client.get(f"/made/up/{k}")
        client.request(method, "/v1/campaigns")
    counted = figures(client, "damper_rig_requests_total")
    assert counted["GET", "/v1/campaigns/{campaign_id}", "404"] == 5.0
    assert counted["GET", "none", "404"] == 5.0
    assert sum(number for (method, *_), number in counted.items() if method == "other") == 5.0
    assert not any("made" in label.lower() for labels in counted for label in labels)
    took = figures(client, "damper_rig_request_seconds_count")
    assert took["GET", "/v1/campaigns/{campaign_id}"] == 5.0


def told_by_a_worker(settings: Settings, rig_id: str, address: str) -> WorkerEnd:
    """The end of a line at which a worker says that it streams a test."""
    worker = WorkerEnd(lambda order: {"ok": True})
    worker.start()
    worker.keep("state", {"state": "running", "text": "", "test": "a", "fifo": 0.25})
    secret, host = worker.secret, socket.gethostname()
    write_place(
        settings.lines_dir,
        Place(rig_id=rig_id, address=address, port=worker.port, secret=secret, host=host, pid=os.getpid()),
    )
    return worker


def test_the_fifo_of_a_rig_is_told_while_a_test_is_streamed_and_not_afterwards(
    client: httpx.Client, settings: Settings, body: dict[str, Any]
) -> None:
    address = "modbus://127.0.0.1:5021"
    rig = accepted(client, {**body, "rig": address})
    streaming, other = (told_by_a_worker(settings, one, address) for one in (rig, "of-no-rig"))
    name = "damper_rig_fifo_ratio"
    try:
        assert until_figures(client, name, lambda found: bool(found)) == {(rig,): 0.25}
        streaming.keep("state", {"state": "running", "text": "", "test": "a", "fifo": None})
        until_figures(client, name, lambda found: not found)
        streaming.keep("state", {"state": "running", "text": "", "test": "b", "fifo": 0.5})
        until_figures(client, name, lambda found: found == {(rig,): 0.5})
        streaming.keep("state", {"state": "free", "text": ""})
        until_figures(client, name, lambda found: not found)
    finally:
        streaming.close("the test ends")
        other.close("the test ends")


def test_a_service_without_its_database_is_alive_and_not_ready(
    client: httpx.Client, app: FastAPI, settings: Settings
) -> None:
    for route in ("/v1/health/live", "/v1/health/ready", "/healthz"):
        assert client.get(route).json()["status"] == "ok"
    away = settings.data_dir.with_name("away")
    settings.data_dir.rename(away)
    try:
        app.state.service.database.close()  # its idle connections, which still hold the file
        assert client.get("/v1/health/live").status_code == 200
        for route in ("/v1/health/ready", "/healthz", "/metrics"):
            answer = client.get(route)
            assert (answer.status_code, answer.headers["retry-after"]) == (503, str(RETRY_AFTER_S)), answer.text
            assert answer.headers["content-type"] == "application/problem+json"
            assert str(settings.data_dir) not in answer.text
            assert "sqlite" not in answer.text.lower()
    finally:
        away.rename(settings.data_dir)
    assert client.get("/v1/health/ready").status_code == 200


def test_a_rig_that_does_not_answer_a_stop_is_named_and_nothing_that_a_library_said(
    client: httpx.Client, body: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # and nobody listens there
        address = f"modbus://127.0.0.1:{taken.getsockname()[1]}"
        rig = accepted(client, {**body, "rig": address})
        answer = client.post(f"/v1/rigs/{rig}/stop")
    assert answer.status_code == 504
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["detail"] == (
        f"rig {address}: the stop was not acknowledged: press the emergency stop "
        "(it did not say that it is at rest: the log says why)"
    )
    [told] = [one.getMessage() for one in caplog.records if "could not be made safe" in one.getMessage()]
    assert "Modbus Error" in told  # what the library said
