"""A process that explains, or only looks whether its input would be refused, seen from the service."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import Any, Self

from api.errors import InputError, ProcessError
from identification.errors import DataError

__all__ = ["Finding", "Job", "refuse"]

_CHECK_S = 120.0
_END_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What a process answered: what it found, or in one line why it found nothing."""

    verdict: str = ""
    effects: tuple[tuple[str, float], ...] = ()
    trouble: str = ""
    refused: bool = False  # the trouble is with the input


class Job:
    """One task in a process of its own; it ends when this process dies. ``progress`` is (share done, phase)."""

    def __init__(
        self,
        model: Mapping[str, Any] | None,  # the JSON of a model file
        runs: Sequence[Path],
        held_out: Sequence[Path],
        *,
        output: Path | None,  # None: only look
        reproduce: str = "",
    ) -> None:
        self.progress = (0.0, "starting")
        self._answer: dict[str, Any] = {}  # any JSON that the process says last
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "api.jobs"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
        task = {
            "model": model,
            "runs": [str(path) for path in runs],
            "held_out": [str(path) for path in held_out],
            "output": "" if output is None else str(output),
            "reproduce": reproduce,
        }
        assert self._process.stdin is not None  # a pipe was asked for
        self._process.stdin.write(json.dumps(task).encode() + b"\n")
        self._process.stdin.flush()
        self._reader = Thread(target=self._read, name="output of explain", daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()  # nothing where it has ended
        self._process.wait(_END_S)
        self._reader.join(_END_S)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    @property
    def pid(self) -> int:
        return self._process.pid

    def ended(self, within_s: float) -> bool:
        """Whether it has ended, after waiting for it at most so long."""
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            return False
        self._reader.join(_END_S)
        return True

    def finding(self) -> Finding:
        """What it answered; call it when it has ended."""
        answer = self._answer
        if "verdict" in answer:
            return Finding(verdict=answer["verdict"], effects=tuple((n, c) for n, c in answer["effects"]))
        if "failed" in answer:
            return Finding(trouble=answer["failed"])
        if "refused" in answer:
            return Finding(trouble=answer["refused"], refused=bool(answer["refused"]))
        return Finding(trouble=f"the process that explained it ended without an answer ({self._process.returncode})")

    def _read(self) -> None:
        assert self._process.stdout is not None  # a pipe was asked for
        for line in self._process.stdout:
            said = json.loads(line)
            if "done" in said:
                self.progress = (float(said["done"]), str(said["text"]))
            else:
                self._answer = said


def refuse(model: Mapping[str, Any] | None, runs: Sequence[Path], held_out: Sequence[Path]) -> None:
    """Raise DataError, in the words of the command line, where this model and these runs can't be explained."""
    with Job(model, runs, held_out, output=None) as job:
        if not job.ended(_CHECK_S):
            raise InputError(f"{len(runs) + len(held_out)} runs: not read within {_CHECK_S:g} s: give fewer")
        found = job.finding()
    if found.trouble:
        raise DataError(found.trouble) if found.refused else ProcessError(found.trouble)
