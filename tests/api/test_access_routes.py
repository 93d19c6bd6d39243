"""Every route says what it needs, and every request is asked for it before anything of it is read."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from sqlalchemy import update

from api.access.keys import KeyStore
from api.access.layers import routes_of
from api.access.rules import RULES, Rules
from api.access.scopes import Scope
from api.app import create_app
from api.settings import Settings
from api.store.database import Database
from api.store.tables import keys
from tests.api.route_paths import NOBODY, path_of
from tests.api.serving import serving

SCOPES = tuple(Scope)
WRONG = f"dr_{'0' * 12}_{'A' * 43}"


@dataclass(frozen=True)
class Lab:
    """A service that needs keys, and one key of each kind."""

    client: httpx.Client
    app: FastAPI
    keys: dict[str, str]
    database: Database

    def ask(self, method: str, path: str, key: str | None, **more: object) -> httpx.Response:
        headers = {} if key is None else {"authorization": f"Bearer {self.keys.get(key, key)}"}
        self.client.cookies.clear()  # of a sign-in before
        with self.client.stream(method, path, headers=headers, **more) as response:  # type: ignore[arg-type]
            if not response.headers["content-type"].startswith("text/event-stream"):
                response.read()
            return response


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("lab"), requests_per_s=float("inf"))
    with Database(settings.store_url) as database:
        store, made = KeyStore(database), {}
        for scope in SCOPES:
            made[scope.value] = store.create(f"{scope}-key", scope, expires_days=None, created_by="test")[1]
        for name in ("expired", "revoked"):
            record, made[name] = store.create(name, Scope.ADMIN, expires_days=1.0, created_by="test")
            if name == "revoked":
                store.revoke(record.id)
                continue
            with database.writing() as connection:
                connection.execute(update(keys).where(keys.c.id == record.id).values(expires_at_s=1.0))
        app = create_app(settings, with_workers=False)
        with serving(app) as client:
            yield Lab(client=client, app=app, keys=made, database=database)


def test_every_route_declares_what_it_needs_and_every_line_of_the_table_is_a_route(lab: Lab) -> None:
    assert set(routes_of(lab.app)) == set(RULES)


def test_a_route_that_declares_nothing_is_open_to_administrators_only() -> None:
    rules = Rules([("GET", "/v1/forgotten"), ("GET", "/v1/forgotten/{name}")])
    assert rules.find("GET", "/v1/forgotten").scope is Scope.ADMIN
    assert rules.find("GET", "/v1/forgotten/x").scope is Scope.ADMIN
    assert rules.find("HEAD", "/v1/forgotten/x").scope is Scope.ADMIN


def test_each_scope_includes_those_before_it() -> None:
    assert [[has.includes(needed) for needed in SCOPES] for has in SCOPES] == [
        [True, False, False, False],
        [True, True, False, False],
        [True, True, True, False],
        [True, True, True, True],
    ]


# everything but signing out, which needs a session and is tested with one
@pytest.mark.parametrize(("method", "path"), [route for route in RULES if route != ("DELETE", "/v1/session")])
def test_a_route_answers_the_right_key_and_nobody_else(lab: Lab, method: str, path: str) -> None:
    needed, there = RULES[(method, path)].scope, path_of(path)
    if needed is None:
        assert lab.ask(method, there, None).status_code in (200, 404)
        return
    for shown in (None, WRONG, "dr_", "expired", "revoked"):
        _forget_failures(lab)
        answer = lab.ask(method, there, shown, content=b"{")
        assert answer.status_code == 401, (shown, answer.text)
        assert answer.headers["www-authenticate"].startswith("Bearer")
    for scope in SCOPES:
        answer = lab.ask(method, there, scope.value, content=b"{")
        if scope.includes(needed):
            assert answer.status_code not in (401, 403, 429, 500), answer.text
        else:
            assert answer.status_code == 403
            assert f"scope {needed}" in answer.json()["detail"]


def _forget_failures(lab: Lab) -> None:
    lab.app.state.service.access.failures._left.clear()  # slowing down wrong keys has a test of its own


def test_an_unknown_path_says_nothing_to_strangers(lab: Lab) -> None:
    _forget_failures(lab)
    assert lab.ask("GET", "/v1/nothing", None).status_code == 401
    assert lab.ask("GET", "/v1/nothing", "read").status_code == 404


def test_a_refused_request_is_refused_before_its_body_is_parsed_or_limited(lab: Lab) -> None:
    _forget_failures(lab)
    assert lab.ask("POST", "/v1/campaigns", None, content=b"x" * 5 * 2**20).status_code == 401
    assert lab.ask("POST", "/v1/campaigns", "schedule", content=b"x" * 5 * 2**20).status_code == 413


def test_wrong_keys_are_slowed_down_and_the_right_one_from_the_same_address_is_not(lab: Lab) -> None:
    _forget_failures(lab)
    answers = [lab.ask("GET", "/v1/campaigns", WRONG) for _ in range(40)]
    assert {answer.status_code for answer in answers} == {401, 429}
    assert int(answers[-1].headers["retry-after"]) >= 1
    assert lab.ask("GET", "/v1/campaigns", "read").status_code == 200
    _forget_failures(lab)


@pytest.mark.parametrize(
    "header",
    [
        "Bearer",
        "Basic dXNlcjpwYXNz",
        "Bearer {admin} {admin}",
        "Bearer {admin}x",
        "Bearer {admin}, Bearer {admin}",
        "Token {admin}",
        "{admin}",
    ],
)
def test_what_is_nearly_a_key_is_none(lab: Lab, header: str) -> None:
    _forget_failures(lab)
    shown = header.format(admin=lab.keys["admin"])
    assert lab.client.get("/v1/campaigns", headers={"authorization": shown}).status_code == 401


def test_two_headers_with_keys_are_none(lab: Lab) -> None:
    _forget_failures(lab)
    both = [("authorization", f"Bearer {lab.keys[name]}") for name in ("read", "admin")]
    assert lab.client.get("/v1/campaigns", headers=both).status_code == 401


def test_a_key_is_made_shown_once_used_and_revoked_over_http(lab: Lab) -> None:
    admin = {"authorization": f"Bearer {lab.keys['admin']}"}
    made = lab.client.post("/v1/keys", json={"name": "bench 3", "scope": "schedule"}, headers=admin)
    assert (made.status_code, made.headers["cache-control"]) == (201, "no-store")
    key, key_id = made.json()["key"], made.json()["id"]
    assert made.headers["location"] == f"/v1/keys/{key_id}"
    own = {"authorization": f"Bearer {key}"}
    assert lab.client.get("/v1/session", headers=own).json() == {
        "name": "bench 3",
        "scope": "schedule",
        "key_id": key_id,
        "session": False,
    }
    listed = lab.client.get("/v1/keys", headers=admin)
    assert key.split("_", 2)[2] not in listed.text
    assert [one["name"] for one in listed.json()["keys"] if one["id"] == key_id] == ["bench 3"]
    assert lab.client.delete(f"/v1/keys/{key_id}", headers=admin).json()["revoked"]
    assert lab.client.get("/v1/session", headers=own).status_code == 401
    assert lab.client.delete(f"/v1/keys/{key_id}", headers=admin).status_code == 200
    _forget_failures(lab)


@pytest.mark.parametrize(
    "body",
    [
        {"name": "", "scope": "read"},
        {"name": "x", "scope": "root"},
        {"name": "x", "scope": "read", "expires_days": 0},
        {"name": "x", "scope": "read", "expires_days": 1e9},
        {"name": "a\nb", "scope": "read"},
        {"name": "x", "scope": "read", "colour": "red"},
    ],
)
def test_a_key_that_cannot_be_is_refused(lab: Lab, body: dict[str, object]) -> None:
    answer = lab.client.post("/v1/keys", json=body, headers={"authorization": f"Bearer {lab.keys['admin']}"})
    assert answer.status_code == 422


def test_a_key_has_a_rate_and_stopping_has_none(tmp_path: Path, body: dict[str, object]) -> None:
    settings = Settings(data_dir=tmp_path, requests_per_s=1.0)
    with Database(settings.store_url) as database:
        key = KeyStore(database).create("x", Scope.ADMIN, expires_days=None, created_by="test")[1]
    headers = {"authorization": f"Bearer {key}"}
    with serving(create_app(settings, with_workers=False)) as client:
        statuses = [client.get("/v1/rigs", headers=headers).status_code for _ in range(6)]
        assert statuses.count(200) >= 2
        limited = client.get("/v1/rigs", headers=headers)
        assert limited.status_code == 429
        assert int(limited.headers["retry-after"]) >= 1
        for order in ("stop", "abort"):
            for _ in range(10):
                assert client.post(f"/v1/campaigns/{NOBODY}/{order}", headers=headers).status_code == 404


@pytest.fixture
def signed_in(lab: Lab) -> Iterator[httpx.Client]:
    _forget_failures(lab)
    lab.app.state.service.access.sign_ins._left.clear()
    with httpx.Client(base_url=lab.client.base_url, timeout=30) as client:
        answer = client.post("/v1/session", headers={"authorization": f"Bearer {lab.keys['operate']}"})
        assert answer.status_code == 201
        yield client


def own(client: httpx.Client) -> dict[str, str]:
    return {"origin": str(client.base_url).rstrip("/")}


def test_the_cookie_of_a_session_is_out_of_reach_of_scripts_and_of_other_sites(lab: Lab) -> None:
    lab.app.state.service.access.sign_ins._left.clear()
    answer = lab.client.post("/v1/session", headers={"authorization": f"Bearer {lab.keys['read']}"})
    cookie = answer.headers["set-cookie"]
    lab.client.cookies.clear()
    name, _, rest = cookie.partition("=")
    assert name == "damper-rig-session"
    assert "HttpOnly" in rest
    assert "SameSite=strict" in rest
    assert "Path=/" in rest
    assert "Max-Age=43200" in rest
    assert "Domain" not in rest
    assert lab.keys["read"].split("_", 2)[2] not in cookie


def test_a_session_reads_and_changes_from_the_own_page_and_ends(lab: Lab, signed_in: httpx.Client) -> None:
    token = signed_in.cookies["damper-rig-session"]
    assert signed_in.get("/v1/session").json()["session"] is True
    assert signed_in.post(f"/v1/campaigns/{NOBODY}/hold", headers=own(signed_in)).status_code == 404
    assert signed_in.post(f"/v1/campaigns/{NOBODY}/hold", headers={"sec-fetch-site": "same-origin"}).status_code == 404
    assert signed_in.delete("/v1/session", headers=own(signed_in)).status_code == 204
    again = lab.client.get("/v1/session", headers={"cookie": f"damper-rig-session={token}"})
    assert again.status_code == 401


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "http://elsewhere.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:1"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
        {"origin": "http://[", "sec-fetch-site": "same-origin"},
    ],
)
def test_a_session_changes_nothing_from_anywhere_else(signed_in: httpx.Client, headers: dict[str, str]) -> None:
    for order in ("hold", "stop", "abort"):
        assert signed_in.post(f"/v1/campaigns/{NOBODY}/{order}", headers=headers).status_code == 403
    if headers:
        assert signed_in.get("/v1/live", headers=headers).status_code == 403


def test_a_session_ends_with_its_key(lab: Lab) -> None:
    record, key = KeyStore(lab.database).create("leaves", Scope.READ, expires_days=None, created_by="test")
    access = lab.app.state.service.access
    access.keyring.refresh()
    access.sign_ins._left.clear()
    with httpx.Client(base_url=lab.client.base_url, timeout=30) as client:
        assert client.post("/v1/session", headers={"authorization": f"Bearer {key}"}).status_code == 201
        with client.stream("GET", "/v1/live") as stream:
            lines = stream.iter_lines()
            assert next(lines).startswith("event: ")
            KeyStore(lab.database).revoke(record.id)
            access.keyring.refresh()
            revoked = time.monotonic()
            for _ in lines:  # the stream that is open ends too
                pass
            assert time.monotonic() - revoked < 5.0
        assert client.get("/v1/session").status_code == 401
    _forget_failures(lab)


def test_signing_in_is_slowed_down(lab: Lab) -> None:
    lab.app.state.service.access.sign_ins._left.clear()
    headers = {"authorization": f"Bearer {lab.keys['read']}"}
    statuses = [lab.client.post("/v1/session", headers=headers).status_code for _ in range(12)]
    lab.client.cookies.clear()
    assert statuses[:10] == [201] * 10
    assert 429 in statuses


def test_a_browser_without_a_session_is_led_to_the_sign_in_page(lab: Lab) -> None:
    answer = lab.client.get("/docs", headers={"accept": "text/html,*/*"})
    assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in?next=/docs")
    assert 'id="key"' in lab.client.get(answer.headers["location"]).text


def test_refused_keys_and_scopes_are_logged_with_where_they_came_from(
    lab: Lab, caplog: pytest.LogCaptureFixture
) -> None:
    _forget_failures(lab)
    lab.ask("GET", "/v1/rigs", WRONG)
    lab.ask("GET", "/v1/keys", "read")
    wrong, small = [record.getMessage() for record in caplog.records if record.name == "damper_rig.access"]
    assert wrong.startswith("refused from 127.0.0.1: this key is not known")
    assert "read-key" in small
    assert "'/v1/keys'" in small


def test_no_other_site_is_given_leave_to_read(lab: Lab) -> None:
    asked = {"origin": "http://elsewhere.example", "access-control-request-method": "POST"}
    answer = lab.client.options("/v1/campaigns", headers=asked)
    assert answer.status_code in (401, 403, 405)
    assert not [name for name in answer.headers if name.startswith("access-control")]
