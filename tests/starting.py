"""Commands that a test starts in a process of their own, and that begin at once: ``tests.preloaded`` forks them.

Where it is the start that a test is about, it starts the command as a user does.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Self


class Started:
    """A ``damper-rig sim``, ``serve`` or ``worker`` in a session of its own, which ends when this process does.

    ``url`` is set by ``wait_until_ready``. Where there is no ``log``, it writes where the tests write.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        log: Path | None = None,
        environ: Mapping[str, str] | None = None,
        folder: Path | None = None,
    ) -> None:
        self.name, self.url, self.log = arguments[0], "", log
        self._status: int | None = None
        theirs_in, self._input = os.pipe()
        self._output, theirs_out = os.pipe()
        self._ended, tells = os.pipe()
        errors = os.dup(2) if log is None else os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        asked = {
            "arguments": [*arguments, "--with-parent"],
            "environ": dict(os.environ if environ is None else environ),
            "folder": str(Path.cwd() if folder is None else folder),
        }
        channel, given = _preloaded(), (theirs_in, theirs_out, errors, tells)
        socket.send_fds(channel, [json.dumps(asked).encode()], given)
        self.pid = int(channel.recv(100))
        for descriptor in given:
            os.close(descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def line(self, within_s: float = 60.0) -> str:
        """The next line that it writes; "" where it ends instead."""
        said = b""
        while not said.endswith(b"\n"):
            assert select.select([self._output], [], [], within_s)[0], f"{self.name}: nothing within {within_s:g} s"
            one = os.read(self._output, 1)
            if not one:
                break
            said += one
        return said.decode().strip()

    def wait_until_ready(self, within_s: float = 60.0) -> str:
        said = self.line(within_s)
        assert said.startswith("ready "), f"{self.name}: {said!r}"
        self.url = said.removeprefix("ready ")
        return self.url

    def running(self) -> bool:
        return self._end_within(0.0) is None

    def kill(self) -> None:
        """End it at once, as a crash would."""
        self._send(signal.SIGKILL)
        self.stop()

    def stop(self, within_s: float = 30.0) -> int:
        """Terminate it and wait; kill it where it does not end in time. Returns its exit status; safe to call twice."""
        self._send(signal.SIGTERM)
        status = self._end_within(within_s)
        if status is None:
            self._send(signal.SIGKILL)
            status = self._end_within(5.0)
            assert status is not None
        if self._input >= 0:
            os.close(self._input)
            os.close(self._output)
            os.close(self._ended)
            self._input = -1
        return status

    def _send(self, number: signal.Signals) -> None:
        if self.running():
            os.kill(self.pid, number)

    def _end_within(self, seconds: float) -> int | None:
        """Its exit status, as a Popen has it, as soon as it has ended; None where it still runs."""
        if self._status is None and select.select([self._ended], [], [], seconds)[0]:
            self._status = int(os.read(self._ended, 100))
        return self._status


@cache
def _preloaded() -> socket.socket:
    """The end of a channel to the process that forks, which ends when it closes."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("preloaded.py")), str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )

    def end() -> None:
        ours.close()
        process.wait(30.0)

    atexit.register(end)
    return ours
