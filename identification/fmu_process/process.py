"""A process for foreign code, which may crash, hang or print."""

from __future__ import annotations

import os
import signal
import weakref
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, TypeVar

from identification.errors import SimulationError

Task = TypeVar("Task")
Answer = TypeVar("Answer")

START_S = 120.0  # for the process to start


class ForeignProcess:
    """One process for one file of foreign code; it ends with `close`, or when this object is no longer used.

    After a crash or a time-out the next call starts another process.
    """

    def __init__(self, label: str) -> None:
        self._label = label
        self._running: _Running | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process starts its own."""
        return ForeignProcess, (self._label,)

    def ask(self, function: Callable[[Task], Answer], task: Task, patience_s: float) -> Answer:
        """The value of `function` for `task`, computed in the other process.

        Raises SimulationError where it fails or crashes, with the last line that it printed, and where it takes longer
        than `patience_s`: then it is ended.
        """
        self._running = running = self._running or _Running()
        try:
            return running.pool.submit(function, task).result(patience_s)
        except TimeoutError as error:
            os.kill(running.pid, signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
            self.close()
            raise SimulationError(f"{self._label} took more than {patience_s:g} s: is it stuck?") from error
        except BrokenProcessPool as error:
            text = f"{self._label}: the FMU crashed{running.last_words()}"
            self.close()
            raise SimulationError(text) from error
        except SimulationError as error:
            raise SimulationError(f"{error}{running.last_words()}") from error

    def close(self) -> None:
        """End the process; safe to call twice."""
        if self._running is not None:
            self._running.end()
            self._running = None


class _Running:
    """A running process and the file into which it prints."""

    def __init__(self) -> None:
        folder = Path(mkdtemp(prefix="foreign-"))
        self._said = folder / "said"
        self._said.touch()
        self.pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=quiet, initargs=(self._said,))
        self.end = weakref.finalize(self, _end, self.pool, folder)
        self.pid = self.pool.submit(os.getpid).result(START_S)

    def last_words(self) -> str:
        """The last line that it printed, in brackets; empty where it printed none."""
        lines = self._said.read_text(encoding="utf-8", errors="replace").split("\n")
        last = [line.strip() for line in lines if line.strip()]
        return f" (it printed: {last[-1][:160]})" if last else ""


def _end(pool: ProcessPoolExecutor, folder: Path) -> None:
    pool.shutdown()
    rmtree(folder, ignore_errors=True)


def quiet(said: Path) -> None:
    """Redirect what foreign code prints into a file: standard output is for the answer."""
    handle = os.open(said, os.O_WRONLY | os.O_APPEND)
    os.dup2(handle, 1)
    os.dup2(handle, 2)
