"""A real Dask cluster for tests: processes of this machine that nobody outside of it can reach."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]

_SCHEDULER = """
import asyncio
from distributed import Scheduler

async def main():
    async with Scheduler(host="127.0.0.1", port=0, dashboard=False, dashboard_address="127.0.0.1:0") as scheduler:
        print(scheduler.address, flush=True)
        await scheduler.finished()

asyncio.run(main())
"""
_WORKER = """
import asyncio, sys
from distributed import Worker

async def main():
    quiet = {"dashboard": False, "dashboard_address": "127.0.0.1:0", "memory_limit": 0}
    async with Worker(sys.argv[1], host="127.0.0.1", nthreads=1, local_directory=sys.argv[2], **quiet) as worker:
        print(worker.address, flush=True)
        await worker.finished()

asyncio.run(main())
"""


class DaskOnLoopback:
    """A scheduler and its workers, each a process of its own, none of them heard outside this machine."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._all = folder, list[subprocess.Popen[str]]()
        self.address = self._started(_SCHEDULER).stdout.readline().strip()  # type: ignore[union-attr]

    def add_workers(self, count: int) -> list[subprocess.Popen[str]]:
        workers = [self._started(_WORKER, self.address, str(self._folder)) for _ in range(count)]
        for worker in workers:
            assert worker.stdout is not None
            assert worker.stdout.readline().startswith("tcp://127.0.0.1:")
        return workers

    def _started(self, script: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", script, *arguments]
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
        )
        self._all.append(process)
        return process

    def close(self) -> None:
        while self._all:
            process = self._all.pop()
            process.kill()
            process.communicate()


@contextmanager
def dask_on_loopback(folder: Path) -> Iterator[DaskOnLoopback]:
    with closing(DaskOnLoopback(folder)) as dask:
        yield dask
