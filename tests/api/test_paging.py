"""Lists come in pages that miss nothing and repeat nothing, and what is known already is not sent again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from api.app import create_app
from api.settings import Settings
from tests.api.serving import serving


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)
    with serving(app) as client:
        yield client


def names(answer: httpx.Response) -> list[str]:
    assert answer.status_code == 200, answer.text
    return [one["name"] for one in answer.json()["campaigns"]]


def test_pages_by_link_are_whole_while_campaigns_are_added(client: httpx.Client, body: dict[str, Any]) -> None:
    for k in range(7):
        assert client.post("/v1/campaigns", json={**body, "name": f"c{k}"}).status_code == 201
    page = client.get("/v1/campaigns?limit=3&state=accepted")
    seen = names(page)
    while "next" in page.links:
        client.post("/v1/campaigns", json={**body, "name": "meanwhile"})
        assert "state=accepted" in page.links["next"]["url"]
        page = client.get(page.links["next"]["url"])
        seen += names(page)
    assert seen == ["c6", "c5", "c4", "c3", "c2", "c1", "c0"]
    assert page.json()["next_cursor"] is None
    assert "meanwhile" in names(client.get(page.links["first"]["url"]))


def test_before_and_cursor_are_the_same_page(client: httpx.Client, body: dict[str, Any]) -> None:
    for k in range(3):
        client.post("/v1/campaigns", json={**body, "name": f"d{k}"})
    first = client.get("/v1/campaigns?limit=2").json()
    by_number = names(client.get(f"/v1/campaigns?limit=2&before={first['next_before']}"))
    assert names(client.get(f"/v1/campaigns?limit=2&cursor={first['next_cursor']}")) == by_number


@pytest.mark.parametrize(
    "cursor", ["x", "WzFd!", "W10", "WyJhIl0", "WzBd", "Wy0xXQ", "W3RydWVd", "%F0%9F%98%80", "Ww" * 90]
)
def test_a_cursor_that_the_service_did_not_give_is_refused(client: httpx.Client, cursor: str) -> None:
    answer = client.get(f"/v1/campaigns?cursor={cursor}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/cursor"
    assert client.get("/v1/jobs?cursor=WzFd&before=3").status_code == 422


def test_what_the_client_has_is_not_sent_again_until_it_changes(client: httpx.Client, body: dict[str, Any]) -> None:
    made = client.post("/v1/campaigns", json=body).headers["location"]
    first = client.get(made)
    etag = first.headers["etag"]
    for known in (etag, f'"other", W/{etag}', "*"):
        again = client.get(made, headers={"If-None-Match": known})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
    assert client.get(made, headers={"If-None-Match": '"other"'}).json() == first.json()
    client.post(f"{made}/abort")
    changed = client.get(made, headers={"If-None-Match": etag})
    assert (changed.status_code, changed.json()["state"]) == (200, "aborted")
    assert changed.headers["etag"] != etag


def test_what_has_changed_since_it_was_read_is_not_deleted(client: httpx.Client, body: dict[str, Any]) -> None:
    made = client.post("/v1/campaigns", json=body).headers["location"]
    etag = client.get(made).headers["etag"]
    for wrong in ('"other"', f"W/{etag}"):
        refused = client.delete(made, headers={"If-Match": wrong})
        assert refused.status_code == 412
        assert refused.headers["content-type"] == "application/problem+json"
    assert client.delete(made, headers={"If-Match": etag}).status_code == 204
    assert client.delete(made, headers={"If-Match": "*"}).status_code == 412
