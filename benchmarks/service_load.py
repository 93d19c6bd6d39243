"""A load on an HTTP service, in a process of its own: as many requests as it answers, or a fixed number a second.

    python -m benchmarks.service_load URL PATH --bodies FILE --connections 16 --seconds 5 --rate 250

Plain HTTP/1.1 on asyncio streams and kept connections: nothing is parsed but the status and the length. The bodies are
the lines of a file, sent one after the other and again from the first; with --keyed each request has an Idempotency-Key
of its own. With --rate the
requests are due at fixed moments, and a late answer also delays none: the latency counts from the moment at which a
request was due, so that a service that stands still is seen.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import resource
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import cycle
from pathlib import Path
from urllib.parse import urlsplit
from uuid import uuid4

__all__ = ["Load", "Result"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """What is sent. ``rate``: requests a second; 0: as many as are answered."""

    url: str
    path: str
    bodies: tuple[bytes, ...]
    connections: int
    seconds: float
    rate: float
    header: str = ""
    keyed: bool = False

    def requests(self) -> Iterator[bytes]:
        """The requests, without end."""
        made = [self._request(body) for body in self.bodies or (b"",)]
        for head, body in cycle(made):
            key = f"idempotency-key: {uuid4()}\r\n".encode() if self.keyed else b""
            yield head + key + b"\r\n" + body

    def _request(self, body: bytes) -> tuple[bytes, bytes]:
        host = urlsplit(self.url).netloc
        head = f"{'POST' if body else 'GET'} {self.path} HTTP/1.1\r\nhost: {host}\r\n"
        if self.header:
            head += f"{self.header}\r\n"
        if body:
            head += f"content-type: application/json\r\ncontent-length: {len(body)}\r\n"
        return head.encode(), body


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Answers with a status below 400, a second; ``cpu``: share of a core that the load itself needed."""

    per_s: float
    p50_s: float
    p99_s: float
    refused: int
    cpu: float


async def run(load: Load) -> Result:
    """Send the load and wait for its answers."""
    parts = urlsplit(load.url)
    latencies: list[float] = []
    refused = 0
    begun = time.perf_counter()
    due = begun
    requests = load.requests()

    def next_due() -> float | None:
        nonlocal due
        if load.rate:
            due += 1.0 / load.rate
            return None if due > begun + load.seconds else due
        return None if time.perf_counter() > begun + load.seconds else time.perf_counter()

    async def connection() -> None:
        nonlocal refused
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        while (at := next_due()) is not None:
            if load.rate and (wait := at - time.perf_counter()) > 0:
                await asyncio.sleep(wait)
            writer.write(next(requests))
            head = await reader.readuntil(b"\r\n\r\n")
            length = int(head.lower().split(b"content-length:")[1].split(b"\r\n")[0])
            await reader.readexactly(length)
            latencies.append(time.perf_counter() - at)
            refused += head[9:12] >= b"400"
        writer.close()

    await asyncio.gather(*(connection() for _ in range(load.connections)))
    spent = time.perf_counter() - begun
    latencies.sort()
    used = resource.getrusage(resource.RUSAGE_SELF)
    return Result(
        per_s=(len(latencies) - refused) / spent,
        p50_s=latencies[len(latencies) // 2],
        p99_s=latencies[int(0.99 * (len(latencies) - 1))],
        refused=refused,
        cpu=(used.ru_utime + used.ru_stime) / spent,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("path")
    parser.add_argument("--bodies", type=Path)
    parser.add_argument("--keyed", action="store_true")
    parser.add_argument("--connections", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rate", type=float, default=0.0)
    parser.add_argument("--header", default="")
    given = parser.parse_args()
    load = Load(
        url=given.url,
        path=given.path,
        bodies=tuple(given.bodies.read_bytes().splitlines()) if given.bodies else (),
        connections=given.connections,
        seconds=given.seconds,
        rate=given.rate,
        header=given.header,
        keyed=given.keyed,
    )
    print(json.dumps(asdict(asyncio.run(run(load)))))


if __name__ == "__main__":
    main()
