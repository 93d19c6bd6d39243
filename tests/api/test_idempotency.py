"""A request that is repeated with its Idempotency-Key creates nothing, on whichever service of one store it arrives."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import update

from api.app import create_app
from api.errors import InputError
from api.settings import Settings
from api.store.database import Database
from api.store.idempotency import GivenAnswer, IdempotencyKeys, KeyedRequest
from api.store.tables import idempotency_keys
from tests.api.measured import MODEL
from tests.api.serving import serving

DAY_S = 86400.0
REQUEST = KeyedRequest(key="k", address="POST /v1/things", fingerprint="a" * 64)
ANSWER = GivenAnswer(status=201, location="/v1/things/1", answer='{"id": 1}')


@pytest.fixture
def two(database_url: str, tmp_path: Path) -> Iterator[tuple[httpx.Client, httpx.Client]]:
    """Two services on one store."""
    with ExitStack() as stack:
        apps = [
            create_app(Settings(data_dir=tmp_path / "data", database_url=database_url), with_workers=False)
            for _ in range(2)
        ]
        first, second = (stack.enter_context(serving(app)) for app in apps)
        yield first, second


def test_of_many_requests_at_once_on_two_services_one_creates(
    two: tuple[httpx.Client, httpx.Client], body: dict[str, Any]
) -> None:
    headers = {"Idempotency-Key": "8e03978e-40d5-43dd-bc93-6894a57f9324"}

    def post(k: int) -> httpx.Response:
        return two[k % 2].post("/v1/campaigns", json=body, headers=headers)

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(post, range(16)))
    assert {one.status_code for one in answers} == {201}
    assert len({one.text for one in answers}) == 1
    assert len({one.headers["location"] for one in answers}) == 1
    assert sum("idempotency-replayed" not in one.headers for one in answers) == 1
    assert len(two[0].get("/v1/campaigns").json()["campaigns"]) == 1


def test_a_key_with_another_body_or_query_is_refused_and_another_key_creates(
    two: tuple[httpx.Client, httpx.Client], body: dict[str, Any]
) -> None:
    headers = {"Idempotency-Key": "one"}
    assert two[0].post("/v1/campaigns", json=body, headers=headers).status_code == 201
    other = two[1].post("/v1/campaigns", json={**body, "name": "other"}, headers=headers)
    assert other.status_code == 422
    assert "Idempotency-Key" in other.json()["detail"]
    query = two[1].post("/v1/campaigns?dry_run=false", json=body, headers=headers)
    assert query.status_code == 422
    assert two[1].post("/v1/campaigns", json=body, headers={"Idempotency-Key": "two"}).status_code == 201
    assert len(two[0].get("/v1/campaigns").json()["campaigns"]) == 2
    for wrong in ("", "x" * 256, "a b"):
        assert two[0].post("/v1/campaigns", json=body, headers={"Idempotency-Key": wrong}).status_code == 422


def test_keys_hold_over_an_upgrade_because_every_version_makes_the_same_fingerprint(
    two: tuple[httpx.Client, httpx.Client], database: Database
) -> None:
    plan = b'tests = [{name = "s", kind = "sine", sample_rate = 1e3, amplitude = 0.01, frequency = 2.0, cycles = 3}]'
    of = {
        "/v1/designs/file": (b"file=plan.toml", plan, "octet-stream"),
        "/v1/models": (b"", json.dumps(MODEL).encode(), "json"),
    }
    for path, (query, body, kind) in of.items():
        headers = {"Idempotency-Key": path, "Content-Type": f"application/{kind}"}
        answer = two[0].post(f"{path}?{query.decode()}", content=body, headers=headers)
        assert answer.status_code == 201, answer.text
        fingerprint = sha256(b"\n" + query + b"\n" + body).hexdigest()  # nobody is signed in: the first line is empty
        request = KeyedRequest(key=path, address=f"POST {path}", fingerprint=fingerprint)
        kept = IdempotencyKeys(database, keep_s=DAY_S).given(request)
        assert kept is not None
        assert kept.answer == answer.text


def test_a_refused_request_keeps_no_key(two: tuple[httpx.Client, httpx.Client], body: dict[str, Any]) -> None:
    headers = {"Idempotency-Key": "one"}
    assert two[0].post("/v1/campaigns", json={**body, "name": ""}, headers=headers).status_code == 422
    assert two[0].post("/v1/campaigns", json=body, headers=headers).status_code == 201


def test_what_is_created_and_its_key_are_stored_together_or_not_at_all(database: Database) -> None:
    keys = IdempotencyKeys(database, keep_s=DAY_S)

    def fails() -> GivenAnswer:
        keys.once(REQUEST_2, lambda: ANSWER)  # joins the transaction
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        keys.once(REQUEST, fails)
    assert keys.given(REQUEST) is None
    assert keys.given(REQUEST_2) is None
    assert keys.once(REQUEST, lambda: ANSWER) == (ANSWER, False)
    assert keys.once(REQUEST, fails) == (ANSWER, True)


REQUEST_2 = KeyedRequest(key="k2", address="POST /v1/things", fingerprint="a" * 64)


def test_a_key_expires_on_the_clock_of_the_database(database: Database) -> None:
    keys = IdempotencyKeys(database, keep_s=DAY_S)
    keys.once(REQUEST, lambda: ANSWER)
    with pytest.raises(InputError, match="another body"):
        keys.given(KeyedRequest(key="k", address=REQUEST.address, fingerprint="b" * 64))
    with database.writing() as connection:
        age = idempotency_keys.c.created_at_s - DAY_S
        connection.execute(update(idempotency_keys).values(created_at_s=age))
    assert keys.given(REQUEST) is None
    other = KeyedRequest(key="k", address=REQUEST.address, fingerprint="b" * 64)
    assert keys.once(other, lambda: ANSWER) == (ANSWER, False)
