"""Every bad request is answered with 4xx and one line that says what is wrong; nothing of it is kept."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from api.app import create_app
from api.settings import Settings
from api.store.tables import campaigns
from tests.api.serving import serving


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    return create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as client:
        yield client


def refused(client: httpx.Client, response: Any, *words: str) -> None:
    assert 400 <= response.status_code < 500, response.text
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert set(problem) == {"type", "title", "status", "detail", "instance", "errors"}
    assert problem["status"] == response.status_code
    detail = problem["detail"]
    assert detail
    assert "\n" not in detail
    assert len(detail) < 400
    assert all(word in detail for word in words), detail
    assert client.get("/v1/campaigns").json() == {"campaigns": [], "next_before": None, "next_cursor": None}


def without(body: dict[str, Any], key: str) -> dict[str, Any]:
    return {k: v for k, v in body.items() if k != key}


@pytest.mark.parametrize("key", ["name", "rig", "specimen", "tests"])
def test_a_missing_key_is_named(client: httpx.Client, body: dict[str, Any], key: str) -> None:
    refused(client, client.post("/v1/campaigns", json=without(body, key)), key, "missing")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"nmae": "x"}, ["nmae", "not a known key", "specimen"]),
        ({"name": ""}, ["name", "''", "printable"]),
        ({"name": 7}, ["name", "7", "string"]),
        ({"name": "a\nb"}, ["name", "printable"]),
        ({"name": "x" * 201}, ["name", "200"]),
        ({"specimen": "\u0000"}, ["specimen", "printable"]),
        ({"specimen": "\ud800"}, ["specimen", "printable"]),
        ({"rig": "http://rig"}, ["http://rig", "modbus://HOST:PORT"]),
        ({"rig": "modbus://host:99999"}, ["99999"]),
        ({"rig": "modbus://"}, ["modbus://HOST:PORT"]),
        ({"interlocks": ["smell:0:1:stop"]}, ["smell", "does not exist"]),
        ({"interlocks": ["force:0:1:stop"] * 51}, ["interlocks", "51 entries"]),
        ({"interlocks": ["x" * 101]}, ["interlock", "100 printable"]),
        ({"interlocks": [7]}, ["interlocks.0", "7", "string"]),
        ({"tests": []}, ["tests", "0 entries"]),
        ({"tests": {}}, ["tests", "list"]),
        ({"tests": [7]}, ["tests.0", "7", "dictionary"]),
        ({"tests": [{}]}, ["tests[0]", "name", "missing"]),
    ],
)
def test_a_wrong_value_is_named_with_what_would_be_right(
    client: httpx.Client, body: dict[str, Any], change: dict[str, Any], words: list[str]
) -> None:
    refused(client, client.post("/v1/campaigns", content=json.dumps({**body, **change}), headers=JSON), *words)


JSON = {"content-type": "application/json"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "sinus"}, ["slow", "kind", "sinus", "triangle"]),
        ({"frequency": -1.0}, ["slow", "frequency", "-1"]),
        ({"frequency": float("nan")}, ["tests.0.frequency", "nan"]),
        ({"sample_rate": 10**400}, ["tests.0.sample_rate", "1329 bits"]),
        ({"amplitde": 0.1}, ["slow", "amplitde", "not a known key"]),
        ({"cycles": 10**9}, ["slow", "cycles"]),
        ({"amplitude": "big"}, ["slow", "amplitude", "big"]),
        ({"held_out": "yes"}, ["held_out", "yes"]),
        ({"name": "fast"}, ["fast", "more than once"]),
        ({"name": "\ud800"}, ["tests.0.name", "surrogate"]),
    ],
)
def test_a_wrong_test_is_named_with_what_would_be_right(
    client: httpx.Client, body: dict[str, Any], change: dict[str, Any], words: list[str]
) -> None:
    first = {**body["tests"][0], **change}
    text = json.dumps({**body, "tests": [first, body["tests"][1]]})
    refused(client, client.post("/v1/campaigns", content=text, headers=JSON), *words)


@pytest.mark.parametrize(
    ("content", "status", "words"),
    [
        (b"", 422, ["missing"]),
        (b"{", 400, ["not JSON"]),
        (b"\xff\xfe", 400, []),
        (b"null", 422, []),
        (b"[1]", 422, []),
        (b'"campaign"', 422, []),
        (b"[" * 100_000, 400, []),
        (b'{"name": ' + b"[" * 900 + b"]" * 900 + b"}", 422, []),
        (b"x" * (2**20 + 1), 413, ["1048576 bytes"]),
    ],
)
def test_a_body_that_is_no_campaign_is_refused(
    client: httpx.Client, content: bytes, status: int, words: list[str]
) -> None:
    response = client.post("/v1/campaigns", content=content, headers=JSON)
    assert response.status_code == status, response.text
    refused(client, response, *words)


def test_a_body_without_a_length_is_limited_too(client: httpx.Client) -> None:
    response = client.post("/v1/campaigns", content=(b"x" * 2**20 for _ in range(5)), headers=JSON)
    assert response.status_code == 413


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/v1/campaigns/nobody", 404),
        ("/v1/campaigns/nobody/runs", 404),
        ("/v1/campaigns/nobody/runs/none", 404),
        ("/v1/campaigns/nobody/runs/none/loops", 404),
        ("/v1/campaigns/nobody/runs/none/loops?points=1", 422),
        ("/v1/campaigns?limit=0", 422),
        ("/v1/campaigns?limit=many", 422),
        ("/v1/campaigns?before=99999999999999999999", 422),
        ("/v1/campaigns?state=lost", 422),
        ("/v1/campaigns/%00", 404),
        ("/v1/campaigns/..%2f..%2fetc", 404),
        ("/v1/nothing", 404),
        ("/static/../app.py", 404),
        ("/static/live.html", 404),
    ],
)
def test_what_is_not_there_or_cannot_be_asked_is_said_in_one_line(client: httpx.Client, path: str, status: int) -> None:
    response = client.get(path)
    assert response.status_code == status, response.text
    refused(client, response)


def test_the_wrong_method_is_refused_and_aborting_nobody_is_not_found(client: httpx.Client) -> None:
    refused(client, client.delete("/v1/campaigns"), "DELETE")
    response = client.post("/v1/campaigns/nobody/abort")
    assert response.status_code == 404
    refused(client, response, "nobody")


def test_another_sites_page_can_neither_schedule_nor_abort(client: httpx.Client, body: dict[str, Any]) -> None:
    for origin in ("http://elsewhere.example", "null"):
        response = client.post("/v1/campaigns", json=body, headers={"origin": origin})
        assert response.status_code == 403
        refused(client, response, "another site")
    own = client.post("/v1/campaigns/nobody/abort", headers={"origin": str(client.base_url)})
    assert own.status_code == 404


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=10), inner, max_size=3),
    max_leaves=6,
)
KEYS = ("name", "kind", "sample_rate", "amplitude", "frequency", "cycles", "current", "levels", "step_time", "seed")


@settings(
    max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(
    place=st.sampled_from(["name", "rig", "specimen", "tests"]),
    value=values,
    inner=st.dictionaries(st.sampled_from(KEYS), values, max_size=3),
)
def test_whatever_is_sent_the_answer_is_created_or_one_line(
    client: httpx.Client, app: FastAPI, body: dict[str, Any], place: str, value: Any, inner: dict[str, Any]
) -> None:
    changed = {**body, place: value} if not inner else {**body, "tests": [{**body["tests"][0], **inner}]}
    response = client.post("/v1/campaigns", content=json.dumps(changed), headers=JSON)
    if response.status_code == 201:  # what happens to be right is accepted: forget it for the next example
        with app.state.service.database.writing() as connection:
            connection.execute(campaigns.delete())
    else:
        refused(client, response)


def test_the_pages_need_nothing_from_the_web(client: httpx.Client) -> None:
    for path in ("/", "/docs", "/static/live.js", "/static/explanations.js", "/static/live.css"):
        text = client.get(path).text
        for address in re.findall(r"\w+://[^\s'\"&]+", text):
            assert "127.0.0.1" in address or "HOST" in address, f"{path}: {address}"
    assert "POST /v1/campaigns" in client.get("/docs").text
    assert client.get("/static/plotly.min.js").text.startswith("/**")


def test_a_store_that_is_gone_is_503_in_one_line(tmp_path: Path, body: dict[str, Any]) -> None:
    app = create_app(Settings(data_dir=tmp_path), with_workers=False)
    with serving(app) as client:
        assert client.get("/healthz").json()["status"] == "ok"
        app.state.service.database.engine.dispose()
        (tmp_path / "damper-rig.db").write_bytes(b"this is not a database" * 1000)
        for name in ("damper-rig.db-wal", "damper-rig.db-shm"):
            (tmp_path / name).unlink(missing_ok=True)
        for response in (client.get("/healthz"), client.post("/v1/campaigns", json=body)):
            assert response.status_code == 503
            assert "\n" not in response.json()["detail"]
            assert "campaign store" in response.json()["detail"]
