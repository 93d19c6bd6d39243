"""Another ``damper-rig`` process: start, wait until ready, stop."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from types import TracebackType
from typing import IO, Self

from api.errors import ProcessError

__all__ = ["Child"]


class Child:
    """A ``damper-rig sim``, ``serve`` or ``worker`` in a session of its own: Ctrl-C does not reach it.

    It ends when this process dies, because its standard input closes. ``url`` is set by ``wait_until_ready``.
    """

    def __init__(self, arguments: Sequence[str], log: Path, environ: Mapping[str, str] | None = None) -> None:
        self.name = arguments[0]
        self.url = ""
        self._log_path = log
        self._log: IO[bytes] = log.open("ab")
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "api.cli", *arguments, "--with-parent"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,
            env=None if environ is None else dict(environ),
        )
        self._first_line: Queue[bytes] = Queue()
        self._reader = Thread(target=self._read, name=f"output of {self.name}", daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait_until_ready(self, within_s: float = 60.0) -> str:
        """The address that it serves; raises ProcessError where it ends before or is not ready in time."""
        try:
            line = self._first_line.get(timeout=within_s).decode(errors="replace").strip()
        except Empty as error:
            raise ProcessError(f"{self.name}: not ready within {within_s:g} s: see {self._log_path}") from error
        if not line.startswith("ready "):
            raise ProcessError(f"{self.name}: ended before it was ready: {self._last_words()}")
        self.url = line.removeprefix("ready ")
        return self.url

    def running(self) -> bool:
        return self._process.poll() is None

    def kill(self) -> None:
        """End it at once, as a crash would."""
        self._process.kill()
        self.stop()

    def stop(self, within_s: float = 30.0) -> int:
        """Terminate it and wait; kill it where it does not end in time. Returns its exit status; safe to call twice."""
        if self.running():
            self._process.terminate()
        try:
            status = self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            status = self._process.wait(5.0)
        self._reader.join(5.0)
        for stream in (self._process.stdin, self._process.stdout, self._log):
            if stream is not None:
                stream.close()
        return status

    def _read(self) -> None:
        assert self._process.stdout is not None  # a pipe was asked for
        self._first_line.put(self._process.stdout.readline())
        while self._process.stdout.read(4096):
            pass

    def _last_words(self) -> str:
        lines = self._log_path.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"it printed nothing; see {self._log_path}"
