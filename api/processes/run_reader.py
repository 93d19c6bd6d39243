"""Reads run and plan files from elsewhere, each in a process of its own, a few at once."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import weakref
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from threading import Lock, Thread
from typing import Any, Final, TypeAlias

import numpy as np

from api.errors import Busy, ProcessError
from api.processes.limits import was_at_work
from api.processes.plan_content import MOST_PLAN_BYTES, MOST_SAMPLE_BYTES
from excitation.errors import DesignError, ExcitationFileError
from excitation.kinds import Kind
from excitation.signal import Excitation
from rigctl.errors import RunFileError
from rigctl.runfile import STATUSES

__all__ = ["PlanContent", "RunReader", "RunSummary"]

AT_ONCE: Final = 2  # each may take 1.3 GB for a moment
WAITING: Final = 8  # a run of 10 MB takes 0.1 s: the last of these waits for a second
RETRY_AFTER_S: Final = 5
LATE_S: Final = 30  # until a file may be sent again that was not read in time: what keeps the computer busy goes on
DEADLINE_S: Final = 60.0  # twice its CPU time: it has a lower priority than rig control
ANSWER_BYTES: Final = 8192  # beside the tests of a plan
_ELSE: Final = "the process that reads plan files answered with something else"

Found: TypeAlias = "tuple[dict[str, Any], bytes]"  # of a file: JSON (Any), and what follows it


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """What is known of an uploaded run; checked again here, since the process has read a file from elsewhere."""

    specimen: str
    status: str
    samples: int
    sample_rate_hz: float
    test: str = ""

    def __post_init__(self) -> None:
        kinds = {"specimen": str, "status": str, "samples": int, "sample_rate_hz": float, "test": str}
        if any(type(getattr(self, name)) is not kind for name, kind in kinds.items()):
            raise ProcessError("the process that reads run files answered with something else")
        if self.status not in STATUSES or self.samples < 0 or not (isfinite(self.sample_rate_hz)):
            raise ProcessError("the process that reads run files answered with values that no run has")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanContent:
    """The configurations of the tests in a plan file, which nobody has checked yet. Any: JSON.

    A test with the key ``excitation`` has the excitation of this number.
    """

    tests: list[dict[str, Any]]
    warm_up: dict[str, Any] | None
    excitations: tuple[Excitation, ...] = ()

    def __post_init__(self) -> None:
        tables = [*self.tests, *([] if self.warm_up is None else [self.warm_up])] if type(self.tests) is list else [0]
        if any(type(table) is not dict for table in tables):
            raise ProcessError(_ELSE)


def _excitations(described: Any, raw: bytes) -> tuple[Excitation, ...]:
    """Excitations from what the process says of them, and from their channels. Any: JSON, which is checked here."""
    found: list[Excitation] = []
    values, begins = np.frombuffer(raw, np.float64, len(raw) // 8), 0
    try:
        for one in described:
            samples, channels = int(one["samples"]), 1 + bool(one["with_current"])
            ends = begins + samples * channels
            if not begins < ends <= values.size:
                raise ProcessError(_ELSE)
            displacement, *current = values[begins:ends].reshape(channels, samples)
            found.append(
                Excitation(
                    kind=Kind(one["kind"]),
                    sample_rate_hz=float(one["sample_rate_hz"]),
                    period_samples=int(one["period_samples"]),
                    displacement_m=displacement,
                    current_a=current[0] if current else None,
                    design=dict(one["design"]),
                    figures=dict(one["figures"]),
                )
            )
            begins = ends
    except (LookupError, TypeError, ValueError, DesignError) as error:
        raise ProcessError(_ELSE) from error
    return tuple(found)


class RunReader:
    """A spare process is started with the first file, so that the next one finds the libraries loaded."""

    def __init__(self, *, at_once: int = AT_ONCE, waiting: int = WAITING, deadline_s: float = DEADLINE_S) -> None:
        self._most, self._deadline_s = at_once + waiting, deadline_s
        self._pool = ThreadPoolExecutor(max_workers=at_once, thread_name_prefix="run-reader")
        self._spares: list[subprocess.Popen[bytes]] = []
        self._lock, self._under_way = Lock(), 0
        weakref.finalize(self, _end_all, self._spares)

    async def read(self, path: Path, name: str) -> RunSummary:
        """What is in the run file; ``name`` stands in messages.

        Raises RunFileError where it is refused, or where reading it ended the process; Busy where too many wait, or
        where the computer has so much else to do that it was not read in time.
        """
        found, _ = await self._turn(path, name, "run", RunFileError, ANSWER_BYTES)
        values: dict[str, Any] = {key: found.get(key) for key in RunSummary.__slots__}  # Any: checked there
        return RunSummary(**values)

    async def read_plan(self, path: Path, name: str) -> PlanContent:
        """What is in the plan or excitation file, by the same process; raises ExcitationFileError and Busy."""
        most = ANSWER_BYTES + MOST_PLAN_BYTES + MOST_SAMPLE_BYTES
        found, raw = await self._turn(path, name, "plan", ExcitationFileError, most)
        values: dict[str, Any] = {key: found.get(key) for key in ("tests", "warm_up")}  # Any: checked there
        return PlanContent(**values, excitations=_excitations(found.get("excitations"), raw))

    async def _turn(self, path: Path, name: str, what: str, refusal: type[Exception], most: int) -> Found:
        with self._lock:
            if self._under_way >= self._most:
                raise Busy(f"{self._under_way} files are being read: send {name} again", retry_after_s=RETRY_AFTER_S)
            self._under_way += 1
        try:
            task = {"path": str(path), "name": name, "what": what}
            return await asyncio.get_running_loop().run_in_executor(self._pool, self._read, task, refusal, most)
        finally:
            with self._lock:
                self._under_way -= 1

    def _read(self, task: dict[str, str], refusal: type[Exception], most: int) -> Found:
        process = self._take()
        try:
            answer, raw, why = _ask(process, task, self._deadline_s, most)
        finally:
            _end(process)
        if "refused" in answer:
            raise refusal(str(answer["refused"]))
        found = answer.get(task["what"])
        if not isinstance(found, dict):
            raise _broken(process, task, why, refusal)
        return found, raw

    def _take(self) -> subprocess.Popen[bytes]:
        with self._lock:
            taken = self._spares.pop() if self._spares else _start()
            if taken.poll() is not None:  # a spare that somebody has ended
                _end(taken)
                taken = _start()
            self._spares.append(_start())
        return taken


def _start() -> subprocess.Popen[bytes]:
    kept = {key: os.environ[key] for key in ("PYTHONPATH", "SYSTEMROOT") if key in os.environ}
    fixed = {"OPENBLAS_NUM_THREADS": "1", "HDF5_PLUGIN_PRELOAD": "::", "PYTHONUTF8": "1"}  # "::": no filters from files
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "api.processes.read_run_file"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**kept, **fixed},
        cwd=Path(sys.executable).anchor,
        start_new_session=True,
    )


def _ask(
    process: subprocess.Popen[bytes], task: dict[str, str], within_s: float, most: int
) -> tuple[dict[str, Any], bytes, str]:
    """The answer and the bytes behind it, else an empty one and why. Any: JSON from a process that has read a file from
    elsewhere.
    """
    assert process.stdin is not None  # pipes were asked for
    assert process.stdout is not None
    said: list[bytes] = []
    output = process.stdout
    reader = Thread(target=lambda: said.append(output.read(most + 1)), daemon=True)
    reader.start()
    try:
        process.stdin.write(json.dumps(task).encode() + b"\n")
        process.stdin.close()
    except OSError:
        return {}, b"", ""  # it has ended
    reader.join(within_s)
    if reader.is_alive():
        at_work = was_at_work(process, within_s)
        reader.join()
        late = f"it was not read within {within_s:g} s"
        if at_work:
            return {}, b"", late
        raise Busy(f"{task['name']}: {late}, the computer has too much else to do: send it again", retry_after_s=LATE_S)
    try:
        line, _, raw = said[0].partition(b"\n")
        answer = json.loads(line) if len(said[0]) <= most else {}
    except (ValueError, RecursionError):
        return {}, b"", ""
    return (answer, raw, "") if isinstance(answer, dict) else ({}, b"", "")


def _broken(process: subprocess.Popen[bytes], task: dict[str, str], why: str, refusal: type[Exception]) -> Exception:
    status = process.returncode
    if why or status < 0:
        shown = why or f"reading it ended with {signal.Signals(-status).name}"
        return refusal(f"{task['name']}: damaged: {shown}: write the {task['what']} again")
    return ProcessError(f"the process that reads {task['what']} files ended with status {status}")


def _end(process: subprocess.Popen[bytes]) -> None:
    """Wait for a moment where it has answered; otherwise end it."""
    try:
        process.wait(5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            stream.close()


def _end_all(spares: list[subprocess.Popen[bytes]]) -> None:
    while spares:
        process = spares.pop()
        process.kill()
        _end(process)
