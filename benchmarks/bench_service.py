"""How many campaigns the service stores and how many status requests it answers a second, beside bluesky-queueserver.

    python -m benchmarks.bench_service [SECONDS]

Every service is a process of its own; the load comes from another (``benchmarks.service_load``), whose own ceiling is
measured too. PostgreSQL is measured where DAMPER_RIG_TEST_POSTGRESQL names a server. Creations are durable: SQLite with
synchronous=FULL, PostgreSQL with its default, Redis with appendfsync=always. Two campaigns have no test in common.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from random import Random
from typing import Any
from uuid import uuid4

import httpx
from sqlalchemy import create_engine, make_url, text

from api.client import Client, Service
from api.processes.child import Child
from benchmarks.queueserver import ADD, HEADER, queueserver

SECONDS = 5.0
CONNECTIONS = 32  # of a load
DIFFERENT = 2000  # campaigns
WATCHERS = 200
NOBODY = "modbus://127.0.0.1:9"  # the rig of campaigns that only wait; its queue is paused
CEILING = """
import asyncio
answer = b"HTTP/1.1 200 OK\\r\\ncontent-length: 600\\r\\n\\r\\n" + 600 * b"x"
async def serve(reader, writer):
    try:
        while await reader.readuntil(b"\\r\\n\\r\\n"):
            writer.write(answer)
    except asyncio.IncompleteReadError:
        writer.close()
async def main():
    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    print("ready http://127.0.0.1:%d" % server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()
asyncio.run(main())
"""


def sine(name: str, cycles: int) -> dict[str, Any]:
    shape = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "current": 0.5}
    return {"name": name, **shape, "cycles": cycles}


def campaign(rig: str, cycles: int = 2) -> dict[str, Any]:
    """Any: JSON."""
    return {"name": "two sines", "rig": rig, "specimen": "7", "tests": [sine("slow", cycles), sine("fast", cycles)]}


def campaigns(count: int = DIFFERENT) -> bytes:
    """Campaigns that differ in every value, one a line: two sines of 2 … 10 Hz each."""
    random = Random(1)

    def test(name: str) -> dict[str, Any]:
        shape = {"amplitude": round(random.uniform(0.001, 0.005), 6), "frequency": round(random.uniform(2.0, 10.0), 3)}
        return {**sine(name, random.randint(1, 3)), **shape, "current": round(random.uniform(0.0, 2.0), 3)}

    made = ({**campaign(NOBODY), "name": f"sines {k}", "tests": [test("slow"), test("fast")]} for k in range(count))
    return b"\n".join(json.dumps(one).encode() for one in made)


def load(
    url: str,
    path: str,
    *,
    seconds: float,
    body: bytes = b"",
    rate: float = 0.0,
    header: str = "",
    keyed: bool = False,
) -> Any:
    """What `service_load` measured; each line of ``body`` is one. Any: its JSON."""
    with tempfile.NamedTemporaryFile() as file:
        Path(file.name).write_bytes(body)
        command = [sys.executable, "-m", "benchmarks.service_load", url, path, "--seconds", str(seconds)]
        command += ["--connections", str(CONNECTIONS), "--rate", str(rate), "--header", header]
        command += ["--bodies", file.name] if body else []
        command += ["--keyed"] if keyed else []
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def row(what: str, found: Any) -> float:
    print(
        f"{what:58} {found['per_s']:8.0f}/s  p50 {1e3 * found['p50_s']:6.1f} ms  p99 {1e3 * found['p99_s']:6.1f} ms"
        f"  refused {found['refused']}  load {100 * found['cpu']:.0f} % of a core",
        flush=True,
    )
    return float(found["per_s"])


@contextmanager
def postgresql() -> Iterator[str | None]:
    """A database of its own on the server that the environment names."""
    server = os.environ.get("DAMPER_RIG_TEST_POSTGRESQL")
    if not server:
        yield None
        return
    name = f"damper_rig_bench_{uuid4().hex[:8]}"
    engine = create_engine(server, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    try:
        yield make_url(server).set(database=name).render_as_string(hide_password=False)
    finally:
        with engine.connect() as connection:
            connection.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
        engine.dispose()


@contextmanager
def a_service(folder: Path, database: str) -> Iterator[str]:
    """The address of a service with one campaign, whose rig's queue is paused."""
    where = ["--database", database] if database else []
    with Child(["serve", "--data", str(folder), "--port", "0", *where], folder.with_suffix(".log")) as child:
        url = child.wait_until_ready(120.0)
        httpx.post(f"{url}/v1/campaigns", json=campaign(NOBODY), timeout=30).raise_for_status()
        [rig] = httpx.get(f"{url}/v1/rigs", timeout=30).json()["rigs"]
        httpx.post(f"{url}/v1/rigs/{rig['id']}/pause", json={"reason": "a benchmark"}, timeout=30).raise_for_status()
        yield url


def measure(name: str, url: str, seconds: float) -> tuple[float, float]:
    """Creations and status requests a second; each also at half of its rate."""
    body = campaigns()
    rates = []
    for what, path, content in (("create a campaign", "/v1/campaigns", body), ("status", "/v1/campaigns?limit=1", b"")):
        rates.append(row(f"{name}: {what}", load(url, path, seconds=seconds, body=content)))
        half = load(url, path, seconds=seconds, body=content, rate=rates[-1] / 2)
        row(f"{name}: {what}, at half of that", half)
    row(f"{name}: create, with a key", load(url, "/v1/campaigns", seconds=seconds, body=body, keyed=True))
    return rates[0], rates[1]


def measure_queueserver(folder: Path, seconds: float) -> tuple[float, float] | None:
    with queueserver(folder) as url:
        if url is None:
            return None
        added = row(
            "bluesky-queueserver, Redis: add an item",
            load(url, "/api/queue/item/add", seconds=seconds, body=ADD, header=HEADER),
        )
        httpx.post(f"{url}/api/queue/clear", headers=dict([HEADER.split(": ", 1)]), timeout=60)
        asked = row("bluesky-queueserver, Redis: status", load(url, "/api/status", seconds=seconds, header=HEADER))
        return added, asked


def watched(folder: Path) -> None:
    """A test of a minute in real time while many watch: nobody may disturb the stream."""
    with ExitStack() as stack:
        rig = stack.enter_context(Child(["sim", "--listen", "modbus://127.0.0.1:0"], folder / "sim.log"))
        service = stack.enter_context(Child(["serve", "--data", str(folder / "w"), "--port", "0"], folder / "w.log"))
        address, url = rig.wait_until_ready(120.0), service.wait_until_ready(120.0)
        client = stack.enter_context(Client(Service(url=url)))
        accepted = client.submit({**campaign(address), "tests": [sine("minute", 80)]})
        command = [sys.executable, "-m", "benchmarks.service_watchers", url, str(WATCHERS), "15"]
        watchers = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        found = load(url, "/v1/campaigns?limit=1", seconds=15.0, rate=100.0)
        events = json.loads(watchers.communicate(timeout=120)[0])
        ended = client.watch(accepted.id, within_s=300.0)
        [run] = client.runs(accepted.id)
    row(f"status at 100/s, {WATCHERS} watchers, a test streaming", found)
    print(
        f"{WATCHERS} watchers: {events['watching']} stayed, {events['megabytes']:.1f} MB; the test: {ended.state}, "
        f"{run.status}, {run.samples} of 20000 samples (an underrun would end it)"
    )


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    print(f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f} before; {CONNECTIONS} connections")
    results: dict[str, tuple[float, float]] = {}
    with tempfile.TemporaryDirectory() as name, postgresql() as server:
        folder = Path(name)
        with subprocess.Popen([sys.executable, "-c", CEILING], stdout=subprocess.PIPE, text=True) as trivial:
            assert trivial.stdout is not None
            row(
                "the load itself, on a server that only answers",
                load(trivial.stdout.readline().split()[1], "/", seconds=2),
            )
            trivial.terminate()
        for kind, database in (("SQLite", ""), ("PostgreSQL", server)):
            if database is not None:
                with a_service(folder / kind, database) as url:
                    results[kind] = measure(f"damper-rig, {kind}", url, seconds)
        other = measure_queueserver(folder, seconds)
        for kind, (created, asked) in results.items() if other else ():
            print(
                f"damper-rig on {kind} / queueserver: creations {created / other[0]:.1f}, status {asked / other[1]:.1f}"
            )
        watched(folder)


if __name__ == "__main__":
    main()
