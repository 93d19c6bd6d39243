"""Requests that no client should send: generated from a seed, for the tests and for ``bench_http_fuzz``."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

__all__ = ["Hostile", "hostile_requests", "says_too_much"]

_SINE = {"name": "a", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2}
_CAMPAIGN = {"name": "n", "rig": "modbus://127.0.0.1:5020", "specimen": "d", "tests": [_SINE]}
_BODIES: tuple[tuple[str, dict[str, Any]], ...] = (  # routes that check a body and move nothing. Any: JSON
    ("/v1/campaigns/check", _CAMPAIGN),
    ("/v1/designs", {"name": "d", "tests": [_SINE]}),
    ("/v1/models", {"format": "damper-rig/model", "format_version": 1, "kind": "physical", "name": "m", "paths": {}}),
    ("/v1/jobs", {"kind": "fit", "campaign": "none", "model": {}}),
    ("/v1/explanations", {"campaign": "none", "simulated": True}),
    ("/v1/campaigns/none/confirm", {"answer": "yes"}),
)
_READS = ("/v1/campaigns", "/v1/runs", "/v1/jobs", "/v1/designs", "/v1/models", "/v1/rigs", "/v1/specimens", "/v1/none")
_HUGE = "9" * 400
_VALUES = (
    *(_HUGE, f"-{_HUGE}", f"1e{_HUGE}", "1e400", "-0", "NaN", "Infinity", "-Infinity", "1" * 5000, "0x10", "1.", "01"),
    *(
        '"\\ud800"',
        '"\\udfff\\ud800"',
        '"\\u0000"',
        '"' + "x" * 100_000 + '"',
        '"\\x"',
        "'a'",
        "true",
        "null",
        "[]",
        "{}",
    ),
    *(
        "[" * 100_000,
        "[" * 500 + "]" * 500,
        '{"a":' * 100 + "1" + "}" * 100,
        '"../../etc/passwd"',
        '"file:///etc/passwd"',
    ),
)
_TYPES = (
    *(
        "application/json",
        "application/json; charset=utf-16",
        "application/problem+json",
        "text/plain",
        "text/html",
        "",
    ),
    *(
        "multipart/form-data; boundary=x",
        "application/x-www-form-urlencoded",
        "application/octet-stream",
        "\xff",
        "a/b/c",
    ),
)
_ENCODINGS = ("utf-16", "utf-32", "utf-8-sig", "latin-1", "cp037", "utf-7")
# what no answer may hold: a folder of a computer, an address of documentation or of an index, a stack
_TOO_MUCH = re.compile(
    r"Traceback|File \"|site-packages|/usr/|/home/|/root/|/opt/|/tmp/|\.py\b|https?://|sqlalche|pydantic|starlette|sqlite:|postgres"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hostile:
    """One request; ``sent`` is what of it an answer may repeat."""

    method: str
    path: str
    headers: dict[str, str]
    body: bytes

    @property
    def sent(self) -> str:
        return f"{self.path} {self.headers} {self.body.decode('utf-8', 'replace')}"


def hostile_requests(seed: int) -> Iterator[Hostile]:
    """Requests without end, the same for the same seed."""
    random = Random(seed)
    while True:
        yield random.choice((_wrong_value, _wrong_value, _wrong_bytes, _wrong_query, _wrong_path))(random)


def says_too_much(request: Hostile, text: str) -> str:
    """What an answer says of the computer or the program that the request did not say itself; empty: nothing."""
    return next((found for found in _TOO_MUCH.findall(text) if found not in request.sent), "")


def _wrong_value(random: Random) -> Hostile:
    """A body in which one value is another."""
    path, body = random.choice(_BODIES)
    text = json.dumps(body)
    places = [m.span() for m in re.finditer(r'"[^"]*"|-?\d+(\.\d+)?|true', text)]
    start, end = random.choice(places)
    return _post(path, f"{text[:start]}{random.choice(_VALUES)}{text[end:]}".encode())


def _wrong_bytes(random: Random) -> Hostile:
    """A body that was cut, changed, doubled or written in another encoding, or that says it is something else."""
    path, body = random.choice(_BODIES)
    text = json.dumps(body)
    content = text.encode()
    at = random.randrange(len(content))
    kind = "application/json"
    match random.randrange(6):
        case 0:
            content = content[:at]
        case 1:
            content = content[:at] + random.randbytes(random.randrange(1, 9)) + content[at:]
        case 2:
            content = f'{text[:-1]}, "name": "twice", "name": "twice"}}'.encode()
        case 3:
            content = f'{text[:-1]}, "ü": 1}}'.encode(random.choice(_ENCODINGS))
        case 4:
            kind = random.choice(_TYPES)
        case _:
            content = random.randbytes(random.randrange(0, 300))
    return _post(path, content, kind)


def _wrong_query(random: Random) -> Hostile:
    names = ("limit", "cursor", "before", "state", "since", "until", "rig", "dry_run", "removed", "x", "%00", "%C3%A9")
    values = ("0", "-1", _HUGE, "NaN", "%ff", "%00", "true", "", "WzFd", "2026-01-01", "x" * 300, "[]", "%F0%9F%98%80")
    query = "&".join(f"{random.choice(names)}={random.choice(values)}" for _ in range(random.randrange(1, 4)))
    return Hostile(method="GET", path=f"{random.choice(_READS)}?{query}", headers={}, body=b"")


def _wrong_path(random: Random) -> Hostile:
    parts = (
        "..%2f..%2fetc%2fpasswd",
        "%00",
        "%ff",
        "x" * 300,
        "none",
        _HUGE[:200],
        "%F0%9F%98%80",
        "a%0d%0ab",
        "-1",
        "{}",
    )
    tail = random.choice(("", "/data", "/file", "/runs", "/report.json", "/model.json", "/files/x", "/loops", "/none"))
    method = random.choice(("GET", "GET", "DELETE", "PUT", "PATCH", "OPTIONS", "HEAD", "TRACE"))
    headers = {"if-match": '"x"'} if random.random() < 0.2 else {}
    return Hostile(
        method=method, path=f"{random.choice(_READS)}/{random.choice(parts)}{tail}", headers=headers, body=b""
    )


def _post(path: str, body: bytes, kind: str = "application/json") -> Hostile:
    return Hostile(method="POST", path=path, headers={"content-type": kind} if kind else {}, body=body)
