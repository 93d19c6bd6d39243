"""Which executor the user asks for: two variables of the environment, read where a command begins."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from identification.compute.cluster import Cluster
from identification.compute.executor import Executor
from identification.compute.processes import Processes
from identification.compute.running import using
from identification.compute.serial import Serial
from identification.compute.threads import Threads
from identification.compute.workers import available_workers
from identification.errors import ComputeError

EXECUTOR, WORKERS = "DAMPER_RIG_EXECUTOR", "DAMPER_RIG_WORKERS"
_MOST = 1024  # workers: more is a slip of the finger
_ADDRESS = re.compile(r"(tcp|tls)://(\[[0-9a-fA-F:.]+\]|[^\s/:\[\]]+):\d{1,5}")


def workers_from(environment: Mapping[str, str]) -> int:
    """How many workers the user asks for, or the processors that there are.

    Raises ComputeError for what is no number of workers.
    """
    text = environment.get(WORKERS, "").strip()
    if not text:
        return available_workers()
    if not (text.isascii() and text.isdecimal() and 1 <= int(text) <= _MOST):
        raise ComputeError(f"{WORKERS}: '{text}' must be a whole number of workers in 1 … {_MOST}")
    return int(text)


def executor_from(environment: Mapping[str, str], default: str = "threads") -> Executor:
    """The executor that the user asks for; whoever calls closes it.

    Raises ComputeError for a setting that is none, and for an address where nobody answers.
    """
    name, workers = environment.get(EXECUTOR, "").strip() or default, workers_from(environment)
    if _ADDRESS.fullmatch(name):
        return Cluster(name, threads=workers)
    match name:
        case "serial":
            return Serial()
        case "threads":
            return Threads(workers)
        case "processes":
            return Processes(workers)
    raise ComputeError(
        f"{EXECUTOR}: '{name}' must be serial, threads, processes, or the address of a Dask scheduler such as "
        "tcp://127.0.0.1:8786"
    )


@contextmanager
def chosen(environment: Mapping[str, str]) -> Iterator[Executor]:
    """Let everything within run on the executor that the user asks for, see `executor_from`."""
    executor = executor_from(environment)
    try:
        with using(executor):
            yield executor
    finally:
        executor.close()
