"""What arrives on a connection has an end and one meaning, or is refused."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import threading
import tracemalloc
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import httpx
import pytest
from starlette.types import Receive, Scope, Send

from api.access.strict_http import LONGEST_HEAD
from tests.api.serving import serving

HOST = b"Host: a\r\n"
NEXT = b"GET /next HTTP/1.1\r\nHost: a\r\n\r\n"
ENDLESS = b"x" * (20 * LONGEST_HEAD)


def get(*headers: bytes, target: bytes = b"/a", version: bytes = b"HTTP/1.1", host: bytes = HOST) -> bytes:
    return b"GET " + target + b" " + version + b"\r\n" + host + b"".join(one + b"\r\n" for one in headers) + b"\r\n"


def post(*headers: bytes, body: bytes = b"") -> bytes:
    return b"POST /a HTTP/1.1\r\n" + HOST + b"".join(one + b"\r\n" for one in headers) + b"\r\n" + body


def chunked(body: bytes) -> bytes:
    return post(b"Transfer-Encoding: chunked", body=body)


REFUSED = {
    "no host": get(host=b""),
    "two hosts": get(b"Host: b"),
    "a host that is folded": get(host=b"Host: a\r\n b\r\n"),
    "a target of another server": get(target=b"http://elsewhere/a"),
    "a target with a fragment": get(target=b"/a#b"),
    "a target that is not ASCII": get(target=b"/\xff"),
    "a target with a space": get(target=b"/a b"),
    "a tunnel": b"CONNECT a:1 HTTP/1.1\r\n" + HOST + b"\r\n",
    "a method that is none": b"MADEUP /a HTTP/1.1\r\n" + HOST + b"\r\n",
    "another version": get(version=b"HTTP/1.2"),
    "the next version": get(version=b"HTTP/2.0"),
    "the first version": b"GET /a\r\n\r\n",
    "what begins HTTP/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "what begins TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    "a space before the colon": get(b"X : y"),
    "a line without carriage return": get(b"X: y\nZ: w"),
    "a line without line feed": get(b"X: y\rZ: w"),
    "a control character": get(b"X: y\x01"),
    "a null character": get(b"X: y\x00"),
    "two lengths": post(b"Content-Length: 4", b"Content-Length: 5", body=b"hello"),
    "a list of lengths": post(b"Content-Length: 5, 5", body=b"hello"),
    "a length with a sign": post(b"Content-Length: +5", body=b"hello"),
    "a negative length": post(b"Content-Length: -5", body=b"hello"),
    "a hexadecimal length": post(b"Content-Length: 0x5", body=b"hello"),
    "an empty length": post(b"Content-Length: ", body=NEXT),
    "a length beyond numbers": post(b"Content-Length: 99999999999999999999999", body=b"hello"),
    "a length and chunks": post(b"Content-Length: 5", b"Transfer-Encoding: chunked", body=b"0\r\n\r\n" + NEXT),
    "chunks and a length": post(b"Transfer-Encoding: chunked", b"Content-Length: 5", body=b"0\r\n\r\n" + NEXT),
    "two codings": post(b"Transfer-Encoding: gzip", b"Transfer-Encoding: chunked", body=b"0\r\n\r\n"),
    "a list of codings": post(b"Transfer-Encoding: gzip, chunked", body=b"0\r\n\r\n"),
    "chunks that are not last": post(b"Transfer-Encoding: chunked, identity", body=b"0\r\n\r\n"),
    "nearly chunked": post(b"Transfer-Encoding: \x0bchunked", body=b"0\r\n\r\n"),
    "another coding": post(b"Transfer-Encoding: identity", b"Content-Length: 5", body=b"hello"),
    "an empty coding": post(b"Transfer-Encoding:", body=b"0\r\n\r\n"),
    "chunks before they were known": b"POST /a HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "a chunk of negative size": chunked(b"-3\r\nabc\r\n0\r\n\r\n"),
    "a chunk that is larger than numbers": chunked(b"fffffffffffffffff\r\nabc\r\n0\r\n\r\n"),
    "a chunk without its end": chunked(b"3\r\nabcX0\r\n\r\n"),
    "chunks with line feeds alone": chunked(b"3\nabc\n0\n\n"),
    "a header above the limit": get(b"X: " + b"x" * LONGEST_HEAD),
    "headers above the limit": get(*[b"X: y"] * (LONGEST_HEAD // 6 + 1)),
    "another protocol and a body": post(b"Connection: Upgrade", b"Upgrade: h2c", b"Content-Length: 5", body=b"hello"),
    "another protocol and chunks": post(
        b"Connection: Upgrade", b"Upgrade: h2c", b"Transfer-Encoding: chunked", body=b"5\r\nhello\r\n0\r\n\r\n"
    ),
    "an endless target": b"GET /" + ENDLESS,
    "an endless name": get()[:-2] + ENDLESS,
    "an endless value": get()[:-2] + b"X: " + ENDLESS,
    "endless empty lines": b"\r\n" * LONGEST_HEAD,
    "an endless trailer": chunked(b"3\r\nabc\r\n0\r\nX: " + ENDLESS),
    "endless trailers": chunked(b"3\r\nabc\r\n0\r\n" + b"X: y\r\n" * LONGEST_HEAD),
    "an endless extension of a chunk": chunked(b"3;" + ENDLESS),
}


GO_ON = threading.Event()


async def echo(scope: Scope, receive: Receive, send: Send) -> None:
    """Answers with what it was asked, once the whole body has come."""
    if scope["type"] == "lifespan":
        for event in ("startup", "shutdown"):
            await receive()
            await send({"type": f"lifespan.{event}.complete"})
        return
    body, more = b"", True
    while more:
        message = await receive()
        if message["type"] != "http.request":
            return
        body += message["body"]
        more = message["more_body"]
    while scope["path"] == "/waits" and not GO_ON.is_set():
        await asyncio.sleep(0.01)
    headers = [(name.decode("latin-1"), value.decode("latin-1")) for name, value in scope["headers"]]
    query = scope["query_string"].decode()
    asked = {"path": scope["path"], "query": query, "headers": dict(headers), "body": body.decode("latin-1")}
    content = json.dumps(asked).encode()
    length = [(b"content-length", str(len(content)).encode())]
    await send({"type": "http.response.start", "status": 200, "headers": length})
    await send({"type": "http.response.body", "body": content})


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    with serving(echo) as client:
        yield int(httpx.URL(client.base_url).port or 0)


def answers(port: int, *parts: bytes) -> tuple[list[int], list[dict[str, Any]]]:
    """The statuses and bodies of all answers to what is sent, until the connection is closed."""
    got = b""
    with socket.create_connection(("127.0.0.1", port), timeout=30.0) as peer:
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with suppress(ConnectionError):  # it hangs up before everything is sent, or read
            for part in parts:
                peer.sendall(part)
            while piece := peer.recv(2**16):
                got += piece
    statuses = [int(one) for one in re.findall(rb"HTTP/1\.1 (\d{3})", got)]
    return statuses, [json.loads(one) for one in re.findall(rb'\{"path.*?"body": "[^"]*"\}', got)]


@pytest.mark.parametrize("sent", REFUSED.values(), ids=REFUSED.keys())
def test_what_has_no_end_or_two_meanings_is_refused_and_the_connection_closed(port: int, sent: bytes) -> None:
    assert answers(port, sent) in (([400], []), ([], []))  # the answer is lost where more arrives after it
    assert answers(port, get(b"Connection: close"))[0] == [200]


@pytest.mark.parametrize("size", [1, 7])
def test_a_request_that_comes_in_pieces_is_the_same_request(port: int, size: int) -> None:
    headers = (b"X-Empty:", b"X-Space: y \t", b"Transfer-Encoding: Chunked", b"Connection: close")
    sent = post(*headers, body=b"3\r\nabc\r\n2;ext=1\r\nde\r\n0\r\n\r\n").replace(b"/a", b"/a%20b?c=d", 1)
    whole = answers(port, sent)
    assert whole == answers(port, *(sent[k : k + size] for k in range(0, len(sent), size)))
    assert whole[0] == [200]
    [asked] = whole[1]
    assert (asked["path"], asked["query"], asked["body"]) == ("/a b", "c=d", "abcde")
    assert asked["headers"]["x-empty"] == ""
    assert asked["headers"]["x-space"] == "y"


def test_headers_up_to_the_limit_and_bodies_beyond_it_are_read(port: int) -> None:
    assert answers(port, get(b"Connection: close", b"X: " + b"x" * (LONGEST_HEAD - 100)))[0] == [200]
    large = b"x" * (20 * LONGEST_HEAD)
    statuses, [asked] = answers(port, post(b"Connection: close", b"Content-Length: %d" % len(large), body=large))
    assert (statuses, len(asked["body"])) == ([200], len(large))
    many = b"1\r\nx\r\n" * LONGEST_HEAD + b"0\r\n\r\n"
    statuses, [asked] = answers(port, post(b"Connection: close", b"Transfer-Encoding: chunked", body=many))
    assert (statuses, len(asked["body"])) == ([200], LONGEST_HEAD)


def test_what_stands_after_the_body_is_no_header(port: int) -> None:
    trailers = b"3\r\nabc\r\n0\r\nAuthorization: x\r\nHost: b\r\nX: y\r\n\r\n"
    statuses, [asked] = answers(port, post(b"Connection: close", b"Transfer-Encoding: chunked", body=trailers))
    assert (statuses, asked["body"]) == ([200], "abc")
    assert asked["headers"] == {"host": "a", "connection": "close", "transfer-encoding": "chunked"}


def test_what_was_asked_before_nonsense_is_answered_and_nonsense_is_not(port: int) -> None:
    statuses, asked = answers(port, post(b"Content-Length: 1", body=b"x") + b"NONSENSE\r\n\r\n" + NEXT)
    assert (statuses, [one["path"] for one in asked]) == ([200], ["/a"])


def test_of_many_requests_at_once_only_the_first_are_answered(port: int) -> None:
    statuses, asked = answers(port, NEXT * 1000)
    assert 1 <= len(statuses) <= 20
    assert {one["path"] for one in asked} == {"/next"}


@pytest.mark.parametrize("offered", [b"websocket", b"h2c"])
def test_another_protocol_that_is_offered_is_not_taken_and_nothing_is_read_after_it(port: int, offered: bytes) -> None:
    upgrade = (b"Connection: Upgrade", b"Upgrade: " + offered)
    statuses, asked = answers(port, get(*upgrade) + NEXT)
    assert (statuses, [one["path"] for one in asked]) == ([200], ["/a"])
    statuses, [one] = answers(port, post(*upgrade, b"Content-Length: 0") + NEXT)
    assert (statuses, one["path"], one["body"]) == ([200], "/a", "")


def test_the_older_version_needs_no_host_and_is_answered_once(port: int) -> None:
    statuses, [asked] = answers(port, get(host=b"", version=b"HTTP/1.0"))
    assert (statuses, asked["path"], asked["headers"]) == ([200], "/a", {})


def test_a_client_that_waits_for_leave_to_send_its_body_gets_it(port: int) -> None:
    statuses, [asked] = answers(port, post(b"Connection: close", b"Expect: 100-continue", b"Content-Length: 1") + b"x")
    assert (statuses, asked["body"]) == ([100, 200], "x")


def test_nothing_is_kept_of_what_floods_in_while_an_answer_is_owed(port: int) -> None:
    GO_ON.clear()
    got = b""
    with socket.create_connection(("127.0.0.1", port), timeout=30.0) as peer:
        peer.sendall(get(target=b"/waits"))
        tracemalloc.start()
        peer.sendall(get()[:-2])
        for _ in range(20):  # 13 MB
            peer.sendall(ENDLESS)
        answers(port, get(b"Connection: close"))  # the loop has read what came before
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        GO_ON.set()
        with suppress(ConnectionResetError):  # the service closes on what it has not read
            while piece := peer.recv(2**16):
                got += piece
    assert peak < 4 * len(ENDLESS)  # a few reads of the socket, and not the 13 MB
    assert got.startswith(b"HTTP/1.1 200")
