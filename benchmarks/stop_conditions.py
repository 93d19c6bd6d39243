"""What is made hard for the service while a rig is stopped: its store, its disk, and whoever else asks it something."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx

__all__ = ["a_postgresql_of_our_own", "a_small_disk", "filled", "held_up", "load", "locked"]

_NICE = 5  # clients are on other computers
_MODEL = Path(__file__).parents[1] / "api" / "demo" / "data" / "viscous.json"
_SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "cycles": 20, "current": 0.5}


@contextmanager
def a_postgresql_of_our_own(folder: Path) -> Iterator[tuple[str, list[int]]]:
    """A PostgreSQL server in a folder; gives its URL and a list that `held_up` fills with its processes."""
    binaries = max(Path("/usr/lib/postgresql").glob("*/bin"))
    user = "postgres" if os.geteuid() == 0 else None
    data = folder / "postgresql"
    data.mkdir()
    if user:
        shutil.chown(data, user)
        for parent in (folder, *folder.parents):
            with suppress(OSError):
                parent.chmod(parent.stat().st_mode | 0o011)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    common = {"user": user, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    subprocess.run([binaries / "initdb", "-D", data, "-U", "postgres", "-A", "trust"], check=True, **common)
    options = f"-p {port} -k {data} -h 127.0.0.1"
    start = [binaries / "pg_ctl", "-D", data, "-o", options, "-l", data / "log", "-w", "start"]
    subprocess.run(start, check=True, **common)
    try:
        postmaster = int((data / "postmaster.pid").read_text().split()[0])
        yield f"postgresql+psycopg://postgres@127.0.0.1:{port}/postgres", [postmaster]
    finally:
        subprocess.run([binaries / "pg_ctl", "-D", data, "-m", "immediate", "stop"], check=False, **common)


@contextmanager
def held_up(postmaster: int) -> Iterator[None]:
    """A server whose processes do not run: it neither answers nor closes a connection."""
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(postmaster)], capture_output=True, text=True, check=True)
    processes = [postmaster, *map(int, listed.stdout.split())]
    for process in processes:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        for process in processes:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGCONT)


@contextmanager
def locked(database: Path) -> Iterator[None]:
    """An SQLite file that another connection writes and does not finish."""
    connection = sqlite3.connect(database, isolation_level=None, timeout=30.0)
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
    finally:
        connection.execute("ROLLBACK")
        connection.close()


@contextmanager
def a_small_disk(folder: Path) -> Iterator[Path | None]:
    """A disk of 64 MB; None where this computer does not permit one."""
    folder.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64m", "none", folder], check=False, capture_output=True)
    try:
        yield folder if made.returncode == 0 else None
    finally:
        if made.returncode == 0:
            subprocess.run(["umount", "-l", folder], check=False)


@contextmanager
def filled(folder: Path) -> Iterator[None]:
    """A disk without a free byte."""
    path = folder / "filling"
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(2**16))
    with suppress(OSError), path.open("ab", buffering=0) as file:
        while True:
            file.write(b"x")
    try:
        yield
    finally:
        path.unlink()


@contextmanager
def load(kind: str, count: int, base: str, campaign: str) -> Iterator[None]:
    """So many clients of a kind at once, in a process of their own."""
    if not count:
        yield
        return
    command = [sys.executable, "-m", "benchmarks.stop_conditions", kind, str(count), base, campaign]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield
        finally:
            process.kill()


async def _watch(client: httpx.AsyncClient, campaign: str) -> None:
    async with client.stream("GET", "/v1/live", timeout=None) as answer:
        async for _ in answer.aiter_raw():
            pass


async def _explain(client: httpx.AsyncClient, campaign: str) -> None:
    body = {"campaign": campaign, "model": json.loads(_MODEL.read_text())}
    await client.post("/v1/explanations", json=body)


async def _upload(client: httpx.AsyncClient, campaign: str) -> None:
    await client.post("/v1/runs?name=big.h5", content=b"\x89HDF\r\n\x1a\n" + bytes(64 * 2**20))


async def _large_json(client: httpx.AsyncClient, campaign: str) -> None:
    tests = [{"name": f"test {k} {'x' * 150}", **_SINE} for k in range(500)]
    body = {"name": "large", "rig": "modbus://127.0.0.1:9", "specimen": "none", "tests": tests}
    body |= {"envelopes": [{"padding": "x" * 700_000}]}  # refused at the end, after all of it was read
    await client.post("/v1/campaigns", json=body)


_CLIENTS = {"watch": _watch, "explain": _explain, "upload": _upload, "json": _large_json}


async def _flood(kind: str, count: int, base: str, campaign: str) -> None:
    async def one() -> None:
        async with httpx.AsyncClient(base_url=base, timeout=120.0, trust_env=False) as client:
            while True:
                with suppress(httpx.HTTPError):
                    await _CLIENTS[kind](client, campaign)

    clients = [asyncio.create_task(one()) for _ in range(count)]
    await asyncio.sleep(1.0)
    print("ready", flush=True)
    await asyncio.gather(*clients)


if __name__ == "__main__":
    os.nice(_NICE)
    asyncio.run(_flood(sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]))
