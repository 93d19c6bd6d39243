"""Whatever bytes arrive, the answer is one that the service meant: no fault, and nothing about its computer."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice

import httpx
import pytest

from api.app import create_app
from api.settings import Settings
from benchmarks.hostile_requests import hostile_requests, says_too_much
from tests.api.serving import serving


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)
    with serving(app) as client:
        yield client


@pytest.mark.parametrize("seed", range(2))
def test_hostile_requests_have_answers_that_say_nothing_about_the_computer(client: httpx.Client, seed: int) -> None:
    for request in islice(hostile_requests(seed), 150):
        headers = {name: value.encode("latin-1") for name, value in request.headers.items()}
        response = client.request(request.method, request.path, headers=headers, content=request.body)
        shown = f"{request.method} {request.path[:100]} {request.body[:200]!r}: {response.text[:300]}"
        assert response.status_code < 500, shown
        assert not says_too_much(request, response.text), shown
        if response.status_code >= 400 and request.method != "HEAD":
            assert response.headers["content-type"] == "application/problem+json", shown
            assert response.json()["status"] == response.status_code, shown


@pytest.mark.parametrize(
    "content",
    [
        b'{"name": 1' + b"0" * 400 + b"}",
        b'{"name": "\\ud800"}',
        b'{"name": NaN}',
        b'{"name": -Infinity}',
        b"[" * 100_000,
        b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
        b'{"name": 1, "name": 2}',
        '{"name": "é"}'.encode("latin-1"),
        '{"name": "x"}'.encode("utf-32"),
        json.dumps({"name": "x" * 3_000_000}).encode(),
    ],
)
@pytest.mark.parametrize("path", ["/v1/campaigns", "/v1/jobs", "/v1/models", "/v1/designs", "/v1/rigs", "/v1/keys"])
def test_each_of_these_bodies_is_a_problem_of_the_sender(client: httpx.Client, path: str, content: bytes) -> None:
    response = client.post(path, content=content, headers={"content-type": "application/json"})
    assert 400 <= response.status_code < 500, response.text[:300]
    assert response.headers["content-type"] == "application/problem+json"
    assert len(response.content) < 20_000
