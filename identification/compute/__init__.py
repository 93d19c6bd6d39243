"""Where independent work runs: in this thread, on threads, on processes, on a Dask cluster; the answer is the same."""

from identification.compute.cluster import Cluster
from identification.compute.executor import Executor
from identification.compute.processes import Processes
from identification.compute.running import finished, run, run_here, using
from identification.compute.serial import Serial
from identification.compute.settings import EXECUTOR, WORKERS, chosen, executor_from, workers_from
from identification.compute.threads import Threads
from identification.compute.workers import available_workers

__all__ = [
    "EXECUTOR",
    "WORKERS",
    "Cluster",
    "Executor",
    "Processes",
    "Serial",
    "Threads",
    "available_workers",
    "chosen",
    "executor_from",
    "finished",
    "run",
    "run_here",
    "using",
    "workers_from",
]
