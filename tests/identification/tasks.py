"""Tasks for the tests of executors: light to import in another process."""

from __future__ import annotations

import math
import os
import signal
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_info

from identification.compute import run, run_here

Floats = NDArray[np.float64]


def smoothed(signal: Floats, window: Floats) -> Floats:
    spectrum = np.fft.rfft(signal) * np.fft.rfft(window, signal.size)
    return np.fft.irfft(spectrum, signal.size) @ np.vander(signal, 4)


def blas_threads(number: int) -> int:
    """The most threads that a BLAS library of this process uses."""
    return max(one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas")


def of_two_failures(number: int) -> float:
    if number == -1:
        math.factorial(20000)
        raise ValueError("first")
    return math.sqrt(number)


def touched(number: int, folder: Path) -> int:
    """The number, and a file that tells of it; a negative one fails."""
    if number < 0:
        raise ValueError("negative")
    (folder / str(number)).touch()
    return number


def told_and_stuck(pipes: tuple[Path, Path]) -> None:
    """Say that this runs, then wait for what may never come."""
    told, awaited = pipes
    with told.open("w"):
        pass
    with awaited.open():
        pass


def sums(depth: int, at: float) -> float:
    """A tree of tasks, four at every branch."""
    if depth == 0:
        return math.sin(at)
    inner = run if depth > 1 else run_here
    return sum(inner(partial(sums, depth - 1), [at + 0.1 * k for k in range(4)]), start=depth * at)


@dataclass(frozen=True)
class Told:
    """Something to share that tells whenever a process reads it."""

    folder: Path
    size: int

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        (self.folder / f"read by {os.getpid()} {len(list(self.folder.iterdir()))}").touch()


def size_of(number: int, shared: Told) -> int:
    return number * shared.size


def process_of(_: int) -> int:
    return os.getpid()


def killed(number: int) -> int:
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def slow_root(number: int) -> float:
    math.factorial(8000)
    return math.sqrt(number)
