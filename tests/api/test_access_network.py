"""A service as a process of its own, with more against it than a laboratory's network should ever have."""

from __future__ import annotations

import asyncio
import socket
import ssl
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from api.access.busy import BodyPace
from api.access.exposure import check_exposure
from api.cli.main import main
from api.errors import SettingsError
from api.settings import Settings
from tests.api.certificate import a_certificate
from tests.starting import Started

NOBODY = "0" * 32
WITHIN_S = 60.0


def key(capsys: pytest.CaptureFixture[str], data: Path, *arguments: str) -> str:
    assert main(["key", "create", *arguments, "--data", str(data)]) == 0
    return capsys.readouterr().out.splitlines()[-1]


def until(true: Callable[[], bool]) -> None:
    ends = time.monotonic() + WITHIN_S
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.05)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Started]:
    """A service without keys, with a few places for connections, that waits briefly for headers."""
    place = tmp_path_factory.mktemp("network")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DAMPER_RIG_HEADER_S", "2")
        patch.setenv("DAMPER_RIG_CONNECTIONS", "200")
        with Started(["serve", "--data", str(place / "lab"), "--port", "0"], place / "serve.log") as child:
            child.wait_until_ready(120.0)
            yield child


def address(served: Started) -> tuple[str, int]:
    url = httpx.URL(served.url)
    return url.host, int(url.port or 0)


def is_closed(peer: socket.socket) -> bool:
    try:
        return peer.recv(1000) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


def test_whoever_sends_headers_slowly_or_nothing_is_hung_up_on(served: Started) -> None:
    begun, sent = time.monotonic(), 0
    with ExitStack() as stack:
        silent = stack.enter_context(socket.create_connection(address(served)))
        slow = stack.enter_context(socket.create_connection(address(served)))
        again = stack.enter_context(socket.create_connection(address(served)))
        again.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET /healthz HTTP/1.1\r\n")  # and no more
        for peer in (silent, slow, again):
            peer.setblocking(False)

        def all_closed() -> bool:
            nonlocal sent
            if not is_closed(slow):
                try:
                    slow.send(b"GET / HTTP/1.1\r\nX-Slow: "[sent : sent + 1] or b"x")
                    sent += 1
                except OSError:
                    pass
            return is_closed(silent) and is_closed(slow) and is_closed(again)

        until(all_closed)
        assert time.monotonic() - begun > 1.5
        assert sent > 3


@pytest.mark.parametrize("comes", [False, True])
def test_a_body_that_comes_too_slowly_holds_no_place_for_ever(comes: bool) -> None:
    now, got = [0.0], []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        now[0] += 1000.0  # the service is busy with something else: that is not the sender's fault
        got.append(await receive())

    async def whole() -> Message:
        return {"type": "http.request", "body": b"x"}

    async def never() -> Message:
        await asyncio.Event().wait()
        raise AssertionError

    async def send(message: Message) -> None: ...

    layer = BodyPace(app, grace_s=0.01, least_bytes_per_s=1000.0, clock=lambda: now[0])
    asyncio.run(layer({"type": "http"}, whole if comes else never, send))
    assert [message["type"] for message in got] == ["http.request" if comes else "http.disconnect"]


def test_three_hundred_idle_sockets_keep_no_stop_waiting(served: Started) -> None:
    stop = f"{served.url}/v1/campaigns/{NOBODY}/stop"
    assert httpx.post(stop, timeout=WITHIN_S).status_code == 404
    with ExitStack() as stack:
        for _ in range(300):
            stack.enter_context(socket.create_connection(address(served)))
        took_s = []
        for _ in range(5):
            begun = time.monotonic()
            assert httpx.post(stop, timeout=WITHIN_S).status_code == 404
            took_s.append(time.monotonic() - begun)
        assert min(took_s) < 1.0  # the others may wait for a busy computer, not for idle sockets
    assert httpx.get(f"{served.url}/healthz", timeout=WITHIN_S).status_code == 200


def test_lasting_requests_leave_places_for_a_stop_and_give_theirs_back(served: Started) -> None:
    with ExitStack() as stack:
        client = stack.enter_context(httpx.Client(limits=httpx.Limits(max_connections=None), timeout=WITHIN_S))
        statuses = []
        for _ in range(140):
            answer = stack.enter_context(client.stream("GET", f"{served.url}/v1/live"))
            statuses.append(answer.status_code)
        assert statuses.count(200) == 200 - 64
        assert set(statuses) == {200, 503}
        assert httpx.post(f"{served.url}/v1/campaigns/{NOBODY}/stop", timeout=WITHIN_S).status_code == 404
    # The service learns of each hang-up by itself: its places are free again soon, not at once.
    until(lambda: httpx.get(f"{served.url}/healthz", timeout=WITHIN_S).status_code == 200)


@pytest.mark.parametrize(
    "host", ["elsewhere.example", "127.0.0.1.nip.example", "localhost.evil.example:80", "", "[::1"]
)
def test_a_name_that_was_rebound_to_this_address_is_refused(served: Started, host: str) -> None:
    for method, path in (("GET", "/"), ("GET", "/v1/campaigns"), ("POST", f"/v1/campaigns/{NOBODY}/stop")):
        answer = httpx.request(method, served.url + path, headers={"host": host}, timeout=WITHIN_S)
        assert answer.status_code == 421, answer.text
        assert "allowed_hosts" in answer.json()["detail"]


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1", "127.0.0.1", "[::1]:8420"])
def test_the_names_of_this_machine_are_answered(served: Started, host: str) -> None:
    assert httpx.get(f"{served.url}/healthz", headers={"host": host}, timeout=WITHIN_S).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://elsewhere.example"},
        {"origin": "null"},
        {"origin": "https://localhost"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"},
    ],
)
def test_pages_of_other_sites_reach_nothing_also_without_keys(served: Started, headers: dict[str, str]) -> None:
    for method, path in (
        ("GET", "/v1/live"),
        ("GET", "/v1/campaigns"),
        ("POST", "/v1/campaigns"),
        ("POST", f"/v1/campaigns/{NOBODY}/stop"),
    ):
        with httpx.stream(method, served.url + path, headers=headers, timeout=WITHIN_S) as answer:
            assert answer.status_code == 403


@pytest.mark.parametrize("header", ["x-forwarded-for", "forwarded", "via"])
def test_what_a_proxy_passes_on_is_not_local(served: Started, header: str) -> None:
    answer = httpx.get(f"{served.url}/v1/campaigns", headers={header: "1.1 proxy"}, timeout=WITHIN_S)
    assert answer.status_code == 401


def test_every_answer_tells_browsers_what_they_may_do(served: Started) -> None:
    for path in ("/", "/sign-in", "/docs", "/v1/campaigns", "/v1/nothing", "/static/live.js"):
        headers = httpx.get(served.url + path, timeout=WITHIN_S).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert "server" not in headers
        assert "strict-transport-security" not in headers
    page = httpx.get(served.url, timeout=WITHIN_S).headers["content-security-policy"]
    assert "script-src 'self';" in page


def test_the_log_of_a_flood_is_short(served: Started, tmp_path: Path) -> None:
    for _ in range(60):
        with socket.create_connection(address(served)) as peer:
            peer.sendall(b"\x16\x03\x01 this is no HTTP\r\n\r\n")
            peer.recv(1000)
    assert served.log is not None
    said = [line for line in served.log.read_text().splitlines() if "Invalid HTTP" in line]
    assert 1 <= len(said) <= 6


def test_keys_hold_within_seconds_and_a_first_key_ends_free_access(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = tmp_path / "lab"
    with Started(["serve", "--data", str(data), "--port", "0"], tmp_path / "serve.log") as child:
        child.wait_until_ready(120.0)

        def status(shown: str | None = None) -> int:
            headers = {} if shown is None else {"authorization": f"Bearer {shown}"}
            return httpx.get(f"{child.url}/v1/campaigns", headers=headers, timeout=WITHIN_S).status_code

        assert status() == 200
        made = httpx.post(f"{child.url}/v1/keys", json={"name": "x", "scope": "admin"}, timeout=WITHIN_S)
        assert made.status_code == 409  # the first key is made on the machine
        first = key(capsys, data, "Anna Berg", "--scope", "admin")
        until(lambda: status() == 401)
        assert status(first) == 200
        assert main(["key", "revoke", first.split("_")[1], "--data", str(data)]) == 0
        begun = time.monotonic()
        until(lambda: status(first) == 401)
        assert time.monotonic() - begun < 20.0, "the service reads its keys every second"
        assert status() == 401  # a service whose keys are all revoked is not open again
        second = key(capsys, data, "Ben", "--scope", "admin")
        until(lambda: status(second) == 200)
        headers = {"authorization": f"Bearer {second}"}
        httpx.post(f"{child.url}/v1/campaigns/{NOBODY}/stop", headers=headers, timeout=WITHIN_S)

        def audit() -> list[dict[str, object]]:
            answer = httpx.get(f"{child.url}/v1/audit", headers=headers, timeout=WITHIN_S)
            return list(answer.json()["audit"])

        until(lambda: any(one["action"] == "campaign.stop" for one in audit()))
        stop, *before = audit()
        assert (stop["who"], stop["address"], stop["status"]) == (f"Ben (key {second.split('_')[1]})", "127.0.0.1", 404)
        assert stop["target"] == f"/v1/campaigns/{NOBODY}/stop"
        assert [one["action"] for one in before] == ["key.create", "key.revoke", "key.create", "key.create"]
    assert main(["key", "list", "--data", str(data)]) == 0
    listed = capsys.readouterr().out
    assert "Anna Berg" in listed
    assert "revoked" in listed
    for shown in (first, second):
        assert shown.split("_", 2)[2] not in listed + (tmp_path / "serve.log").read_text()


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[Path, Path]:
    return a_certificate(tmp_path)


def test_over_tls_cookies_are_secure_and_idle_sockets_keep_nobody_out(
    tmp_path: Path,
    certificate: tuple[Path, Path],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = tmp_path / "lab"
    shown = key(capsys, data, "Anna", "--scope", "operate")
    monkeypatch.setenv("DAMPER_RIG_TLS_CERTIFICATE", str(certificate[0]))
    monkeypatch.setenv("DAMPER_RIG_TLS_KEY", str(certificate[1]))
    monkeypatch.setenv("DAMPER_RIG_CONNECTIONS", "100")
    with Started(["serve", "--data", str(data), "--port", "0"], tmp_path / "serve.log") as child, ExitStack() as stack:
        assert child.wait_until_ready(120.0).startswith("https://")
        trusted = ssl.create_default_context(cafile=str(certificate[0]))
        client = stack.enter_context(httpx.Client(base_url=child.url, verify=trusted, timeout=WITHIN_S))
        answer = client.post("/v1/session", headers={"authorization": f"Bearer {shown}"})
        assert answer.status_code == 201
        assert answer.headers["set-cookie"].startswith("__Host-damper-rig-session=")
        assert "Secure" in answer.headers["set-cookie"]
        assert "max-age=" in answer.headers["strict-transport-security"]
        assert client.get("/v1/session").json()["name"] == "Anna"
        for _ in range(150):
            stack.enter_context(socket.create_connection(address(child)))  # and no handshake
        took_s, own = [], {"origin": child.url}
        for _ in range(5):
            begun = time.monotonic()
            assert client.post(f"/v1/campaigns/{NOBODY}/stop", headers=own).status_code == 404
            took_s.append(time.monotonic() - begun)
        assert min(took_s) < 1.0  # the others may wait for a busy computer, not for handshakes
        with (
            socket.create_connection(address(child)) as peer,
            trusted.wrap_socket(peer, server_hostname="localhost") as inside,
        ):
            assert inside.version() in ("TLSv1.2", "TLSv1.3")


FROM_NETWORK = {"host": "192.0.2.7"}


@pytest.mark.parametrize(
    ("settings", "keys_made", "words"),
    [
        ({**FROM_NETWORK}, False, ["192.0.2.7", "no key", "damper-rig key create"]),
        ({"host": "0.0.0.0", "insecure_network": True}, False, ["no key"]),
        ({**FROM_NETWORK}, True, ["tls_certificate", "trusted_proxies", "insecure_network"]),
        ({"access": "keys"}, False, ["access is keys", "damper-rig key create"]),
        ({"trusted_proxies": "127.0.0.1"}, False, ["trusted_proxies", "no key"]),
        ({"tls_certificate": "/none.pem", "tls_key": "/none.pem"}, True, ["tls_certificate", "/none.pem"]),
    ],
)
def test_a_service_that_would_be_open_to_others_does_not_start(
    settings: dict[str, object], keys_made: bool, words: list[str]
) -> None:
    with pytest.raises(SettingsError) as caught:
        check_exposure(Settings(**settings), keys_made=keys_made)  # type: ignore[arg-type]
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("settings", [{"insecure_network": True}, {"trusted_proxies": "10.0.0.0/24"}])
def test_with_keys_it_starts_behind_a_named_proxy_or_by_the_switch(settings: dict[str, object]) -> None:
    check_exposure(Settings(**FROM_NETWORK, **settings), keys_made=True)  # type: ignore[arg-type]


def test_serve_says_in_one_line_why_it_does_not_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--data", str(tmp_path), "--host", "0.0.0.0", "--port", "0"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "damper-rig key create" in said.err
