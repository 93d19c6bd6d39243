"""The process of a job, as the service starts, follows and ends it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import Any, Self

from api.errors import Busy, InputError, ProcessError
from api.processes.limits import computer_memory, was_at_work
from identification.errors import DataError

__all__ = ["Answer", "JobProcess", "check_in_process"]

# Of the computer's memory. The other half is for the service and the workers (0.3 GB each), the database, and the files
# of runs that the system keeps in memory. A job that takes all of it makes a rig's worker wait for the disk.
MEMORY_SHARE = 0.5
CHECK_S = 120.0
LATE_S = 30  # until a job may be sent again whose check was late: what keeps the computer busy goes on
_KILLED = -9  # SIGKILL
_END_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The last line of a process: the figures of its result, or why there is none, in one line. Any: JSON."""

    result: Mapping[str, Any] = field(default_factory=dict)
    failure: str = ""
    refused: bool = False  # the input was refused


class JobProcess:
    """One job in a process of its own; it ends when this process dies. ``progress`` is (share done, phase).

    With ``folder`` None it only checks the input. ``journal``: where a study keeps what it has done. ``part``: the
    descriptor of a lock that it holds as long as it lives. ``memory_bytes``: what it may take, and each process that it
    starts; 0: ``MEMORY_SHARE`` of the computer's.
    """

    def __init__(
        self,
        kind: str,
        request: Mapping[str, Any],  # JSON
        runs: Sequence[Path],
        held_out: Sequence[Path],
        *,
        folder: Path | None,
        journal: Path | None = None,
        part: int | None = None,
        memory_bytes: int = 0,
    ) -> None:
        self.progress = (0.0, "starting")
        self._last: dict[str, Any] = {}  # any JSON: the last line of the process
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "api.jobs"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            pass_fds=() if part is None or sys.platform == "win32" else (part,),
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
        task = {
            "kind": kind,
            "request": dict(request),
            "runs": [str(path) for path in runs],
            "held_out": [str(path) for path in held_out],
            "folder": "" if folder is None else str(folder),
            "journal": "" if journal is None else str(journal),
            "memory_bytes": memory_bytes or int(MEMORY_SHARE * (computer_memory() or 0)),
        }
        assert self._process.stdin is not None  # a pipe was asked for
        self._process.stdin.write(json.dumps(task).encode() + b"\n")
        self._process.stdin.flush()
        self._reader = Thread(target=self._read, name=f"output of {kind}", daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._kill()
        self._process.wait(_END_S)
        self._reader.join(_END_S)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    @property
    def pid(self) -> int:
        return self._process.pid

    def ended(self, within_s: float) -> bool:
        """Whether it has ended, after waiting for at most ``within_s``."""
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            return False
        self._reader.join(_END_S)
        return True

    def late(self, given_s: float) -> bool:
        """End it, which has not ended after ``given_s``; whether it was at work in that time."""
        return was_at_work(self._process, given_s)

    def answer(self) -> Answer:
        """The result of the process; call it after the process has ended."""
        match self._last:
            case {"result": result}:
                return Answer(result=result)
            case {"refused": why}:
                return Answer(failure=why, refused=True)
            case {"failed": why}:
                return Answer(failure=why)
        status = self._process.returncode
        why = ": it was killed, most often because the memory of the computer ran out" if status == _KILLED else ""
        return Answer(failure=f"the process of the job ended without an answer ({status}){why}")

    def _kill(self) -> None:
        if self._process.poll() is not None:
            return
        if hasattr(os, "killpg"):
            os.killpg(self._process.pid, signal.SIGKILL)  # with every process that it started
        else:
            self._process.kill()

    def _read(self) -> None:
        assert self._process.stdout is not None  # a pipe was asked for
        for line in self._process.stdout:
            said = json.loads(line)
            if "done" in said:
                self.progress = (float(said["done"]), str(said["text"]))
            else:
                self._last = said


def check_in_process(
    kind: str,
    request: Mapping[str, Any],
    runs: Sequence[Path],
    held_out: Sequence[Path],
    *,
    memory_bytes: int = 0,
    within_s: float = CHECK_S,
) -> None:
    """Raise DataError, in the words of the command line, where a job of this kind would be refused. Any: JSON.

    Raises InputError where the check takes longer than ``within_s`` because of the input, Busy where the computer has
    too much else to do.
    """
    with JobProcess(kind, request, runs, held_out, folder=None, memory_bytes=memory_bytes) as process:
        if not process.ended(within_s):
            late = f"{len(runs) + len(held_out)} runs: not read within {within_s:g} s"
            if process.late(within_s):
                raise InputError(f"{late}: give fewer")
            raise Busy(f"{late}, the computer has too much else to do: send it again", retry_after_s=LATE_S)
        answer = process.answer()
    if answer.failure:
        raise DataError(answer.failure) if answer.refused else ProcessError(answer.failure)
