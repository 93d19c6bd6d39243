"""The service behind nginx, over TLS, with deploy/nginx.conf and the settings that stand in it."""

from __future__ import annotations

import json
import os
import re
import select
import shutil
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.api.certificate import a_certificate
from tests.conftest import missing
from tests.starting import Started

DEPLOYED = Path(__file__).parents[2] / "deploy" / "nginx.conf"
NAME = "rig.example"
CLIENT = "127.0.0.2"  # another computer, as far as the proxy can tell
LONG = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.8, "cycles": 400}

MAIN = """
daemon off;
worker_processes 1;
{user}
pid {folder}/nginx.pid;
error_log {folder}/error.log;
events {{ worker_connections 256; }}
http {{
  access_log {folder}/access.log;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  include {folder}/damper-rig.conf;
}}
"""


@dataclass(frozen=True, kw_only=True)
class Proxy:
    port: int
    certificate: Path
    client: httpx.Client  # that signs in
    key: str
    log: Path

    @property
    def own(self) -> dict[str, str]:
        """What a browser adds to an order of its own page."""
        return {"origin": f"https://{NAME}:{self.port}"}

    @property
    def bearer(self) -> dict[str, str]:
        return {"authorization": f"Bearer {self.key}"}


def settings_in(text: str) -> dict[str, str]:
    """The settings of the service that the head of the file asks for, as variables."""
    [line] = [line for line in text.splitlines() if "damper-rig.toml:" in line]
    return {f"DAMPER_RIG_{name.upper()}": value for name, value in re.findall(r'(\w+) = "([^"]*)"', line)}


def put(text: str, **changes: str) -> str:
    """The file with this computer's port, certificate and service."""
    of = {"port": "listen 443", "pem": "/etc/nginx/damper-rig.pem", "key": "/etc/nginx/damper-rig.key"} | {
        "service": "http://127.0.0.1:8420"
    }
    for name, value in changes.items():
        assert text.count(of[name]) == (2 if name == "service" else 1), name
        text = text.replace(of[name], value)
    return text


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxy]:
    nginx = shutil.which("nginx", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin:/opt/homebrew/bin")
    if nginx is None:
        missing("no nginx: install it (Debian: nginx-light)")
    folder = tmp_path_factory.mktemp("proxy")
    pem, secret = a_certificate(folder)
    command = [
        sys.executable,
        "-m",
        "api.cli",
        "key",
        "create",
        "Ada",
        "--scope",
        "admin",
        "--data",
        str(folder / "lab"),
    ]
    key = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout.strip()
    text = DEPLOYED.read_text(encoding="utf-8")
    with ExitStack() as stack:
        # nginx inherits its socket, as at its own upgrade: a port that is only picked may be taken before it binds
        listening = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=128))
        port = int(listening.getsockname()[1])
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        for name, value in settings_in(text).items():
            patch.setenv(name, value)
        arguments = ["serve", "--data", str(folder / "lab"), "--port", "0"]
        service = stack.enter_context(Started(arguments, folder / "serve.log"))
        served = service.wait_until_ready(120.0)
        ours = put(text, port=f"listen 127.0.0.1:{port}", pem=str(pem), key=str(secret), service=served)
        (folder / "damper-rig.conf").write_text(ours, encoding="utf-8")
        user = "user root;" if os.geteuid() == 0 else ""
        (folder / "nginx.conf").write_text(MAIN.format(folder=folder, user=user), encoding="utf-8")
        started = [str(nginx), "-p", str(folder), "-c", str(folder / "nginx.conf"), "-e", str(folder / "error.log")]
        inherited = {**os.environ, "NGINX": f"{listening.fileno()};"}
        process = stack.enter_context(subprocess.Popen(started, pass_fds=[listening.fileno()], env=inherited))
        stack.callback(process.terminate)
        client = stack.enter_context(a_client(port, pem))
        yield Proxy(port=port, certificate=pem, client=client, key=key, log=folder / "access.log")


def a_client(port: int, certificate: Path) -> httpx.Client:
    """Somebody on another computer."""
    way = httpx.HTTPTransport(verify=ssl.create_default_context(cafile=str(certificate)), local_address=CLIENT)
    host = {"host": f"{NAME}:{port}"}
    return httpx.Client(base_url=f"https://127.0.0.1:{port}", headers=host, transport=way, timeout=60.0)


def until(proxy: Proxy, path: str, is_there: Any) -> Any:
    # Any: JSON
    ends = time.monotonic() + 60
    while not is_there(answer := proxy.client.get(path, headers=proxy.bearer).json()):
        assert time.monotonic() < ends, answer
        time.sleep(0.05)
    return answer


def test_a_day_at_the_rig_passes_through_the_proxy(proxy: Proxy, shared_rig: str, folder: Path) -> None:
    client = proxy.client
    signed_in = client.post("/v1/session", headers=proxy.bearer)
    assert signed_in.status_code == 201
    assert signed_in.headers["set-cookie"].startswith(
        "__Host-damper-rig-session="
    )  # it knows that the way is encrypted
    assert "max-age=" in signed_in.headers["strict-transport-security"]

    run = (folder / "slow.h5").read_bytes()
    uploaded = client.post("/v1/runs", params={"name": "slow.h5"}, content=run, headers=proxy.own)
    assert uploaded.status_code == 201, uploaded.text
    assert client.get(f"/v1/runs/{uploaded.json()['id']}/file").content == run

    body = {"name": "proxied", "rig": shared_rig, "specimen": "7", "tests": [{"name": "long", **LONG}]}
    made = client.post("/v1/campaigns", json=body, headers=proxy.own)
    assert made.status_code == 201, made.text
    client.post("/v1/rigs/resume", json={"rig": shared_rig}, headers=proxy.own).raise_for_status()
    campaign = f"/v1/campaigns/{made.json()['id']}"
    with client.stream("GET", "/v1/live") as live:  # cut off by nothing, and not kept until it is long
        lines = iter(live.iter_lines())
        assert "event: samples" in lines
        samples = json.loads(next(lines).removeprefix("data: "))
        assert samples[0]["campaign_id"] == made.json()["id"]
        stopped = client.post(f"{campaign}/stop", headers=proxy.own)
        assert (stopped.status_code, stopped.json()["acknowledged"]) == (202, True)
        took_s = []
        for _ in range(3):
            begun = time.monotonic()
            assert client.post(f"{campaign}/stop", headers=proxy.own).status_code == 202
            took_s.append(time.monotonic() - begun)
        assert min(took_s) < 1.0  # the others may wait for a busy computer, not for the proxy
        assert any('"state":"aborted"' in line for line in lines)
    until(proxy, campaign, lambda campaign: campaign["state"] == "aborted")


def test_the_audit_log_has_the_address_behind_the_proxy_whatever_the_client_says(proxy: Proxy) -> None:
    said = {"x-forwarded-for": "10.9.9.9", "x-real-ip": "10.9.9.9", "forwarded": "for=10.9.9.9"}
    name = f"key {time.monotonic_ns()}"
    made = proxy.client.post("/v1/keys", json={"name": name, "scope": "read"}, headers={**proxy.bearer, **said})
    assert made.status_code == 201, made.text
    noted = until(proxy, "/v1/audit", lambda log: log["audit"][0]["target"] == made.headers["location"])["audit"][0]
    assert (noted["action"], noted["address"]) == ("key.create", CLIENT)
    assert "10.9.9.9" not in proxy.log.read_text()


def test_other_names_other_sites_and_strangers_are_refused_through_the_proxy_too(proxy: Proxy) -> None:
    with a_client(proxy.port, proxy.certificate) as stranger:
        assert stranger.get("/v1/campaigns").status_code == 401
        assert stranger.get("/v1/campaigns", headers={"host": "evil.example"}).status_code == 421
        evil = {**proxy.bearer, "origin": "https://evil.example"}
        assert stranger.post("/v1/rigs/resume", json={"rig": "x"}, headers=evil).status_code == 403
        assert stranger.get("/v1/campaigns", headers=evil).status_code == 403
        unencrypted = {**proxy.bearer, "origin": proxy.own["origin"].replace("https", "http")}
        assert stranger.get("/v1/campaigns", headers=unencrypted).status_code == 403


def an_answer(received: Any) -> tuple[int, bool]:
    """The status of the answer that is read to its end, and whether the connection is said to be kept."""
    status = int(received.readline().split()[1])
    headers = dict(line.decode().lower().rstrip().split(": ", 1) for line in iter(received.readline, b"\r\n"))
    received.read(int(headers["content-length"]))
    return status, headers.get("connection") != "close"


@pytest.mark.parametrize("path", ["/v1/rigs/resume", "/v1/runs?name=a.h5", "/v1/models"])
def test_an_order_refused_before_its_body_came_costs_no_further_order(proxy: Proxy, path: str) -> None:
    """A client may send its next order where the answer did not say that the connection is closed."""
    trusted = ssl.create_default_context(cafile=str(proxy.certificate))
    trusted.maximum_version = ssl.TLSVersion.TLSv1_2  # which sends nothing of its own after its handshake
    with (
        socket.create_connection(("127.0.0.1", proxy.port), timeout=60.0) as plain,
        trusted.wrap_socket(plain, server_hostname="127.0.0.1") as way,
        way.makefile("rb") as received,
    ):
        head = f"Host: {NAME}:{proxy.port}\r\nOrigin: https://evil.example\r\nContent-Length: "
        way.sendall(f"POST {path} HTTP/1.1\r\n{head}2\r\n\r\n".encode())
        select.select([way], [], [], 0.5)  # an early refusal, if there is one
        way.sendall(b"{}")
        status, kept = an_answer(received)
        assert status in (401, 403)
        if kept:
            way.sendall(f"POST {path} HTTP/1.1\r\n{head}2\r\n\r\n{{}}".encode())
            assert an_answer(received)[0] == status
        assert kept == ("/v1/runs" not in path)
