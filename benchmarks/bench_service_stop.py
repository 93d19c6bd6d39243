"""A stop over HTTP while everything else of the service is held up: from the request to the rig that obeys it.

A process of its own reads the registers of the simulated rig every 2 ms, and notes when it leaves ACTIVE. A second row
of each condition stops the rig past a worker that was killed. ``python -m benchmarks.bench_service_stop 20`` stops
twenty times a condition; further arguments name the conditions.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, nullcontext
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from api.processes.child import Child
from benchmarks.stop_conditions import a_postgresql_of_our_own, a_small_disk, filled, held_up, load, locked
from rigctl.device import RigState
from rigctl.errors import TransportError
from rigctl.player import connect
from rigctl.priority import real_time_priority

WITHIN_S = 0.2
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 2.0, "current": 0.5}
_LIVE = ("quiet", "200 watchers", "45 explanations", "8 uploads of 64 MB", "16 bodies of 0.8 MB")
_CLIENTS = dict(zip(_LIVE, (("", 0), ("watch", 200), ("explain", 45), ("upload", 8), ("json", 16)), strict=True))
CONDITIONS = (*_LIVE, "SQLite locked", "disk full", "PostgreSQL held up")


def look_on(url: str, told: Connection) -> None:
    """Send (time, in motion) whenever the rig begins or ceases to play, until the pipe is closed."""
    with real_time_priority(), closing(connect(url)) as wire:
        before = False
        while not told.poll():
            try:
                active = wire.status(0.25).state is RigState.ACTIVE
            except TransportError:
                continue
            if active != before:
                told.send((time.monotonic(), active))
                before = active
            time.sleep(0.002)


@dataclass(slots=True)
class Lab:
    """A service with its rig, and somebody who looks at the rig."""

    base: str
    rig: str
    seen: Connection
    client: httpx.Client

    def post(self, path: str, body: dict[str, Any] | None = None, *, tries: int = 1) -> httpx.Response:
        return self.client.post(f"{self.base}{path}", json=body)

    def submit(self, cycles: int) -> str:
        body = {"name": "stop", "rig": self.rig, "specimen": "7", "tests": [{"name": "s", **SINE, "cycles": cycles}]}
        answer = self.post("/v1/campaigns", body)
        answer.raise_for_status()
        return str(answer.json()["id"])

    def until(self, campaign: str, is_there: Callable[[dict[str, Any]], bool], within_s: float = 120.0) -> None:
        ends = time.monotonic() + within_s
        while True:
            found = self.client.get(f"{self.base}/v1/campaigns/{campaign}")
            if found.status_code == 200 and is_there(found.json()):
                return
            assert time.monotonic() < ends, found.text
            time.sleep(0.05)

    def wait(self, moving: bool, within_s: float = 60.0) -> float:
        """When the rig began or ceased to move."""
        ends = time.monotonic() + within_s
        while time.monotonic() < ends:
            if self.seen.poll(1.0):
                at, active = self.seen.recv()
                if active == moving:
                    return float(at)
        known = self.client.get(f"{self.base}/v1/rigs").text + self.client.get(f"{self.base}/v1/campaigns?limit=2").text
        raise TimeoutError(f"the rig was not seen {'moving' if moving else 'at rest'} within {within_s:g} s: {known}")

    def resume(self) -> None:
        self.post("/v1/rigs/resume", {"rig": self.rig})


@contextmanager
def a_lab(folder: Path, database: str, data: Path) -> Iterator[Lab]:
    environ = {**os.environ, "DAMPER_RIG_LEAST_FREE_BYTES": "1000000", "OPENBLAS_NUM_THREADS": "1"}
    with ExitStack() as stack:
        sim = stack.enter_context(Child(["sim", "--listen", "modbus://127.0.0.1:0"], folder / "sim.log"))
        arguments = ["serve", "--data", str(data), "--port", "0", *(["--database", database] if database else [])]
        service = stack.enter_context(Child(arguments, folder / "serve.log", environ))
        rig = sim.wait_until_ready(120.0)
        base = service.wait_until_ready(120.0)
        ours, its = multiprocessing.get_context("spawn").Pipe()
        watcher = multiprocessing.get_context("spawn").Process(target=look_on, args=(rig, its), daemon=True)
        watcher.start()
        client = stack.enter_context(httpx.Client(timeout=30.0, trust_env=False))
        try:
            yield Lab(base, rig, ours, client)
        finally:
            ours.send("end")
            watcher.join(10.0)


def stop_once(lab: Lab, made_hard: AbstractContextManager[None], *, worker_dead: bool) -> tuple[float, float]:
    """Seconds from the request to the rig that ceases to play, and to the answer."""
    campaign = lab.submit(200)
    lab.resume()
    lab.wait(True)
    line = lab.client.get(f"{lab.base}/v1/rigs").json()["rigs"][0]
    lab.until(campaign, lambda c: c["tests"][0]["samples"] > 0)
    with made_hard:
        if worker_dead:
            os.kill(int(line["worker"].split(":")[1]), signal.SIGKILL)
        with httpx.Client(timeout=30.0, trust_env=False) as stopping:
            begun = time.monotonic()
            answer = stopping.post(f"{lab.base}/v1/campaigns/{campaign}/abort")
            answered = time.monotonic()
        assert answer.status_code == 202, answer.text
        rested = lab.wait(False)
    lab.until(campaign, lambda c: c["ended"] is not None)
    return rested - begun, answered - begun


def conditions(
    lab: Lab, name: str, data: Path, postmaster: int, done: str
) -> Callable[[], AbstractContextManager[None]]:
    """What is around each stop of a condition that is not there all the time."""
    if name == "SQLite locked":
        return lambda: locked(data / "damper-rig.db")
    if name == "disk full":
        return lambda: filled(data)
    if name == "PostgreSQL held up":
        return lambda: held_up(postmaster)
    return nullcontext


def measure(name: str, count: int, folder: Path, *, worker_dead: bool = False) -> None:
    """Print one row of the table."""
    with ExitStack() as stack:
        database, postmaster, data = "", [0], folder / "lab"
        if name == "PostgreSQL held up":
            database, postmaster = stack.enter_context(a_postgresql_of_our_own(folder))
        if name == "disk full":
            small = stack.enter_context(a_small_disk(folder / "small"))
            if small is None:
                print(f"| {name} | not permitted here |", flush=True)
                return
            data = small
        lab = stack.enter_context(a_lab(folder, database, data))
        done = lab.submit(4)
        lab.until(done, lambda c: c["ended"] is not None)
        while lab.seen.poll():
            lab.seen.recv()
        stack.enter_context(load(*_CLIENTS.get(name, ("", 0)), lab.base, done))
        around = conditions(lab, name, data, postmaster[0], done)
        times = np.array([stop_once(lab, around(), worker_dead=worker_dead) for _ in range(count)])
    rest, answer = times[:, 0], times[:, 1]
    within = int(np.sum(rest <= WITHIN_S))
    print(
        f"| {name}{', worker killed' if worker_dead else ''} | {1e3 * np.median(rest):.0f} | {1e3 * rest.max():.0f} "
        f"| {within} of {count} | {1e3 * np.median(answer):.0f} | {1e3 * answer.max():.0f} |",
        flush=True,
    )


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    names = sys.argv[2:] or CONDITIONS
    columns = ("ms until the rig obeys, median", "longest", "within 200 ms", "ms until the answer, median", "longest")
    print(f"| condition | {' | '.join(columns)} |")
    print("|---|---|---|---|---|---|", flush=True)
    for name in names:
        for worker_dead in (False, True) if name == "quiet" else (False,):
            with tempfile.TemporaryDirectory() as folder:
                measure(name, count, Path(folder), worker_dead=worker_dead)


if __name__ == "__main__":
    main()
