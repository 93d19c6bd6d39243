"""Hostile requests against a served process: no 500, and no path, address or stack in any answer.

``python -m benchmarks.bench_http_fuzz [REQUESTS] [SEED]``
"""

from __future__ import annotations

import http.client
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from api.processes.child import Child
from benchmarks.hostile_requests import Hostile, hostile_requests, says_too_much

_REQUESTS = 100_000
_SEED = 20261123
_CONNECTIONS = 4  # two cores serve and send
_CALL_S = 120.0


def main(requests: int = _REQUESTS, seed: int = _SEED) -> int:
    """Send the requests and print the figures; returns 1 where an answer is wrong."""
    with TemporaryDirectory(prefix="damper-rig-fuzz-") as folder:
        log = Path(folder) / "serve.log"
        with Child(["serve", "--data", f"{folder}/lab", "--port", "0"], log) as child:
            base = child.wait_until_ready(300.0)
            began = time.monotonic()
            each = requests // _CONNECTIONS
            with ThreadPoolExecutor(_CONNECTIONS) as pool:
                parts = list(pool.map(lambda k: _send(base, seed + k, each, folder), range(_CONNECTIONS)))
            seconds = time.monotonic() - began
        faults = log.read_text(errors="replace").count("Traceback")
    statuses = sum((statuses for statuses, _ in parts), Counter[int]())
    wrong = [line for _, lines in parts for line in lines]
    print(f"{sum(statuses.values())} requests in {seconds:.0f} s, seed {seed}")
    print("status: " + ", ".join(f"{status}: {count}" for status, count in sorted(statuses.items())))
    print(f"wrong answers: {len(wrong)}, stacks in the log of the service: {faults}")
    print("\n".join(wrong[:20]))
    return 1 if wrong or faults else 0


def _send(base: str, seed: int, count: int, folder: str) -> tuple[Counter[int], list[str]]:
    address = urlsplit(base)
    statuses: Counter[int] = Counter()
    wrong: list[str] = []
    connection = http.client.HTTPConnection(str(address.hostname), address.port, timeout=_CALL_S)
    for request in islice(hostile_requests(seed), count):
        status, kind, text = _answer(connection, request)
        statuses[status] += 1
        why = _why_wrong(request, status, kind, text, folder)
        if why:
            wrong.append(f"{why}: {request.method} {request.path[:80]} {request.body[:120]!r} -> {status} {text[:200]}")
    connection.close()
    return statuses, wrong


def _answer(connection: http.client.HTTPConnection, request: Hostile) -> tuple[int, str, str]:
    try:
        connection.request(request.method, request.path, request.body, request.headers)
        response = connection.getresponse()
        return response.status, response.headers.get("content-type", ""), response.read().decode("utf-8", "replace")
    except (http.client.HTTPException, ConnectionError):
        connection.close()
        return 0, "", ""


def _why_wrong(request: Hostile, status: int, kind: str, text: str, folder: str) -> str:
    if status in (0, 500):
        return "no answer" if status == 0 else "a fault"
    if folder in text:
        return "the folder of the service"
    if status >= 400 and request.method != "HEAD" and kind != "application/problem+json" and text != _BAD_HTTP:
        return "no problem answer"
    return says_too_much(request, text)


_BAD_HTTP = "Invalid HTTP request received."  # of uvicorn, to what is no HTTP at all


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:3])))
