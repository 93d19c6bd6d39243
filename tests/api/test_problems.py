"""Refusals are problems of RFC 9457 that say everything that is wrong at once; a dry run stores nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from pydantic import TypeAdapter

from api.app import create_app
from api.errors import OUTCOMES
from api.jobs.kinds import KINDS
from api.routes.examples import REQUESTS
from api.settings import Settings
from excitation.kinds import DESIGNED
from tests.api.serving import serving

JSON = {"content-type": "application/json"}
NOTHING = {"campaigns": [], "next_before": None, "next_cursor": None}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lab")


@pytest.fixture(scope="module")
def app(place: Path) -> FastAPI:
    return create_app(Settings(data_dir=place), with_workers=False)


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as client:
        yield client


def problem(response: httpx.Response, status: int) -> dict[str, Any]:
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    answer: dict[str, Any] = response.json()
    assert answer["status"] == status
    return answer


def test_every_wrong_key_of_every_test_is_named_with_a_pointer(client: httpx.Client, body: dict[str, Any]) -> None:
    slow, fast = body["tests"]
    wrong = {
        **body,
        "name": "",
        "interlocks": ["force:0:1:stop", "smell:0:1:stop"],
        "tests": [{**slow, "frequency": "x", "amplitde": 1.0}, fast, {**slow, "name": "third", "cycles": -1}],
    }
    answer = problem(client.post("/v1/campaigns", json=wrong), 422)
    assert [one["pointer"] for one in answer["errors"]] == [
        "/name",
        "/interlocks/1",
        "/tests/0/frequency",
        "/tests/0/amplitde",
        "/tests/2",
    ]
    assert all(one["source"] == "body" for one in answer["errors"])
    assert answer["detail"].endswith("(4 more)")
    assert answer["type"] == "/docs#invalid-input"
    assert f'id="{answer["type"].partition("#")[2]}"' in client.get("/docs").text


def test_every_test_beyond_an_envelope_is_named(client: httpx.Client, body: dict[str, Any]) -> None:
    small = {"motion": {"max_displacement": 0.001, "max_velocity": 1.0}}
    answer = problem(client.post("/v1/campaigns", json={**body, "envelopes": [small]}), 422)
    assert [one["pointer"] for one in answer["errors"]] == ["/tests/0", "/tests/1"]
    assert all("displacement" in one["detail"] for one in answer["errors"])


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/v1/campaigns?dryrun=true"),
        ("GET", "/v1/campaigns?limt=3"),
        ("POST", "/v1/campaigns/nobody/abort?now=1"),
        ("GET", "/v1/rigs?x=1"),
        ("GET", "/healthz?x=1"),
        ("GET", "/openapi.json?x=1"),
        ("GET", "/?x=1"),
        ("GET", "/static/live.css?x=1"),
    ],
)
def test_a_query_parameter_that_no_route_reads_is_refused(
    client: httpx.Client, body: dict[str, Any], method: str, path: str
) -> None:
    answer = problem(client.request(method, path, json=body if method == "POST" else None), 422)
    name = path.partition("?")[2].partition("=")[0]
    assert answer["errors"][0]["source"] == "query"
    assert answer["errors"][0]["pointer"] == f"/{name}"
    assert client.get("/v1/campaigns").json() == NOTHING


def test_every_wrong_query_parameter_is_named(client: httpx.Client) -> None:
    answer = problem(client.get("/v1/campaigns?limit=0&before=x&state=lost"), 422)
    assert [one["pointer"] for one in answer["errors"]] == ["/limit", "/before", "/state"]
    assert "once" in problem(client.get("/v1/campaigns?limit=1&limit=2"), 422)["detail"]


@pytest.mark.parametrize("path", ["/v1/campaigns?dry_run=true", "/v1/campaigns/check"])
def test_a_dry_run_says_what_the_campaign_takes_and_stores_nothing(
    client: httpx.Client, body: dict[str, Any], path: str
) -> None:
    rig = {
        "motion": {"max_displacement": 0.05, "max_velocity": 1.0},
        "specimen": {"damping": 2000.0, "heat_capacity": 900.0, "ambient": 20.0},
    }
    response = client.post(path, json={**body, "envelopes": [rig]})
    assert response.status_code == 200, response.text
    answer = response.json()
    assert [test["name"] for test in answer["tests"]] == ["slow", "fast"]
    slow = answer["tests"][0]
    assert slow["displacement_m"] == pytest.approx(0.005, rel=1e-3)
    assert slow["velocity_m_s"] == pytest.approx(0.005 * 2 * 3.14159265 * 4.0, rel=1e-3)
    assert slow["force_n"] == pytest.approx(2000.0 * slow["velocity_m_s"], rel=1e-6)
    # work of a viscous damper: c·v²/2 over the time that the test takes
    assert slow["energy_j"] == pytest.approx(2000.0 * slow["velocity_m_s"] ** 2 / 2 * slow["duration_s"], rel=1e-3)
    assert answer["highest_degc"] == pytest.approx(20.0 + answer["energy_j"] / 900.0, rel=1e-6)
    assert answer["duration_s"] == pytest.approx(sum(t["duration_s"] + t["dwell_s"] for t in answer["tests"]))
    assert client.get("/v1/campaigns").json() == NOTHING


def test_a_test_cannot_name_a_file_of_the_service(client: httpx.Client, body: dict[str, Any]) -> None:
    band = {"f_min": 1.0, "f_max": 5.0, "max_displacement": 0.01, "max_velocity": 0.1}
    design = {"kind": "multisine", "sample_rate": 1000.0, "period_samples": 1000}
    named = {"name": "n", **design, "displacement": {**band, "spectrum": {"record": "/etc/hostname"}}}
    bounds = {"max_displacement": 0.01, "max_velocity": 0.1}
    replayed = {"name": "r", "kind": "replay", "record": "/etc/hostname", "bounds": bounds}
    of_file = {"name": "f", "kind": "file", "record": "/etc/hostname"}
    for one in (named, replayed, of_file):
        with_it = problem(client.post("/v1/campaigns", json={**body, "tests": [one]}), 422)
        assert "upload the file" in with_it["detail"]
    for wrong in ({"warm_up": named}, {"warm_up": replayed}, {"warm_up": of_file}):
        answer = problem(client.post("/v1/campaigns", json={**body, **wrong}), 422)
        assert "upload the file" in answer["detail"]


@pytest.mark.parametrize(
    ("content", "kind", "status", "words"),
    [
        (b"{}", "text/plain", 415, "application/json"),
        (b"{}", None, 415, "application/json"),
        (b'{"name": "a", "name": "b"}', "application/json", 400, "twice"),
        (b'{"name": NaN}', "application/json", 422, "finite"),
        (b'{"name": 1e999}', "application/json", 422, "finite"),
        (b'{"name": ' + b"9" * 5000 + b"}", "application/json", 400, "digits"),
        ('{"name": "x"}'.encode("utf-16"), "application/json", 400, "UTF-8"),
        (b'\xef\xbb\xbf{"name": "x"}', "application/json", 400, "byte order mark"),
        (b'{"name": "\\udc00"}', "application/json", 422, "surrogate"),
        (b'{"\\ud800": 1}', "application/json", 422, "surrogate"),
    ],
)
def test_what_only_looks_like_json_is_refused(
    client: httpx.Client, content: bytes, kind: str | None, status: int, words: str
) -> None:
    headers = {} if kind is None else {"content-type": kind}
    assert words in problem(client.post("/v1/campaigns", content=content, headers=headers), status)["detail"]


def test_unknown_routes_and_methods_are_problems_and_the_methods_are_listed(client: httpx.Client) -> None:
    problem(client.get("/nothing"), 404)
    wrong = client.delete("/v1/campaigns")
    problem(wrong, 405)
    assert wrong.headers["allow"] == "GET, POST"


def test_no_answer_names_a_folder_of_the_service_or_its_store(place: Path, body: dict[str, Any]) -> None:
    own = place / "gone"
    app = create_app(Settings(data_dir=own), with_workers=False)
    with serving(app) as client:
        app.state.service.database.engine.dispose()
        (own / "damper-rig.db").write_bytes(b"this is not a database" * 1000)
        for name in ("damper-rig.db-wal", "damper-rig.db-shm"):
            (own / name).unlink(missing_ok=True)
        for response in (client.get("/healthz"), client.post("/v1/campaigns", json=body)):
            problem(response, 503)
            assert int(response.headers["retry-after"]) > 0
            assert str(place) not in response.text
            assert "sqlite" not in response.text


def test_a_fault_of_the_program_is_a_problem_without_its_stack(app: FastAPI, client: httpx.Client) -> None:
    store = app.state.service.campaigns
    broken = type("Broken", (), {"__getattr__": lambda self, name: 1 / 0})()
    object.__setattr__(app.state.service, "campaigns", broken)
    try:
        response = client.get("/v1/campaigns")
    finally:
        object.__setattr__(app.state.service, "campaigns", store)
    assert "ZeroDivisionError" not in response.text
    assert problem(response, 500)["detail"] == "the service could not do this: its log says why"
    assert response.headers["connection"] == "close"  # it is: who sent the next request on it had no answer


def test_openapi_describes_problems_for_every_route(client: httpx.Client) -> None:
    described = client.get("/openapi.json").json()
    assert "Problem" in described["components"]["schemas"]
    for path, methods in described["paths"].items():
        for method, route in methods.items():
            content = route["responses"]["422"]["content"]
            assert list(content) == ["application/problem+json"], f"{method} {path}"
            assert {str(outcome.http_status) for _, outcome in OUTCOMES} <= set(route["responses"])
    text = json.dumps(described)
    assert "HTTPValidationError" not in text


def test_every_example_of_a_request_is_accepted(client: httpx.Client) -> None:
    described, tried = client.get("/openapi.json").json(), set()
    for path, routes in described["paths"].items():
        content = routes.get("post", {}).get("requestBody", {}).get("content", {}).get("application/json", {})
        schema = content.get("schema", {})
        schema = described["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else schema
        for example in schema.get("examples", []):
            answer = client.post(path, json=example)
            wanted = (404,) if path == "/v1/explanations" else (200, 201)  # its campaign is not here
            assert answer.status_code in wanted, (path, answer.text)
            client.delete(answer.headers.get("location", "/"))
            tried.add(path)
    assert tried >= {"/v1/campaigns", "/v1/campaigns/check", "/v1/designs", "/v1/models", "/v1/explanations"}
    for kind in KINDS.values():
        for example in REQUESTS[kind.request.__name__]:
            TypeAdapter(kind.request).validate_python(example)  # its runs are not here


def test_the_kinds_of_tests_in_openapi_are_those_that_excitation_reads_and_stored_samples(client: httpx.Client) -> None:
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    described = schemas["NewCampaign"]["properties"]["tests"]["items"]
    assert set(described["discriminator"]["mapping"]) == {*DESIGNED, "samples"}
    assert schemas["SineTest"]["properties"]["frequency"]["description"] == "Unit: Hz."
    assert schemas["MotionLimits"]["properties"]["max_velocity"]["description"] == "Unit: m/s."
    assert schemas["SineTest"]["additionalProperties"] is False
