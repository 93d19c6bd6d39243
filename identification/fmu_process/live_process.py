"""The process in which instances of an FMU live, and what it is asked, sample by sample."""

from __future__ import annotations

import os
import tempfile
import weakref
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from shutil import rmtree
from threading import Lock
from typing import Any

from identification.errors import SimulationError
from identification.fmu_process.live import Instance, Opening, Values
from identification.fmu_process.process import quiet

_END_S = 5.0


class LiveProcess:
    """Instances of one FMU, taken from sample to sample; it ends with `close`, or when it is no longer used.

    A question and its answer take a tenth of a millisecond: a pool of processes takes some. Safe to use from threads.
    """

    def __init__(self, label: str, patience_s: float) -> None:
        """`patience_s` is how long one answer may take."""
        self._label, self._patience_s, self._lock, self._count = label, patience_s, Lock(), 0
        self._running: _Running | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process starts its own."""
        return LiveProcess, (self._label, self._patience_s)

    def begin(self, opening: Opening) -> LiveInstance:
        """A new instance, freed when it is no longer used; raises SimulationError."""
        with self._lock:
            self._running = self._running or _Running()
            self._count += 1
            self._ask("begin", self._count, opening)
            return LiveInstance(self, self._count)

    def ask(self, what: str, number: int, *given: object) -> Values:
        """The outputs of an instance for `start` or `tried`; raises SimulationError."""
        with self._lock:
            found: Values = self._ask(what, number, given)
            return found

    def end(self, number: int) -> None:
        """Frees an instance; no error where its process has ended."""
        with self._lock:
            if self._running is not None:
                try:
                    self._ask("end", number, ())
                except SimulationError:
                    return

    def close(self) -> None:
        """End the process; safe to call twice."""
        if self._running is not None:
            self._running.end()
            self._running = None

    def _ask(self, what: str, number: int, given: object) -> Any:
        if self._running is None:
            raise SimulationError(f"{self._label}: the FMU crashed before")
        running, line = self._running, self._running.line
        try:
            line.send((what, number, given))
            if not line.poll(self._patience_s):
                self.close()
                raise SimulationError(f"{self._label} took more than {self._patience_s:g} s: is it stuck?")
            fine, answer = line.recv()
        except (EOFError, OSError) as error:
            text = f"{self._label}: the FMU crashed{running.last_words()}"
            self.close()
            raise SimulationError(text) from error
        if not fine:
            raise SimulationError(f"{answer}{running.last_words()}")
        return answer


class LiveInstance:
    """One instance, which is where it was last taken to. It asks no question twice: each costs a change of process."""

    def __init__(self, process: LiveProcess, number: int) -> None:
        """An instance that `process` has begun."""
        self._process, self._number = process, number
        self._last: tuple[Values, Values] | None = None  # inputs and outputs of the sample that was tried last
        self._kept = False  # that sample has been taken, which the process is told with the next question
        weakref.finalize(self, process.end, number)

    def start(self, values: Values) -> Values:
        """The outputs with inputs that have lasted; once, before all else."""
        return self._process.ask("start", self._number, values)

    def tried(self, values: Values) -> Values:
        """The outputs if the inputs at the next sample were these; raises SimulationError."""
        if self._last is None or self._kept or self._last[0] != values:
            kept, self._kept = self._kept, False
            self._last = values, self._process.ask("tried", self._number, kept, values)
        return self._last[1]

    def taken(self, values: Values) -> Values:
        """Goes on to the next sample; the outputs there."""
        found = self.tried(values)
        self._kept = True
        return found


class _Running:
    """A running process, its line, and the folder in which it unpacks and prints."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._folder = Path(tempfile.mkdtemp(prefix="foreign-"))
        (self._folder / "said").touch()
        self.line, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, self._folder), daemon=True)
        process.start()
        theirs.close()
        self.end = weakref.finalize(self, _end, process, self.line, self._folder)

    def last_words(self) -> str:
        """The last line that it printed, in brackets; empty where it printed none."""
        text = (self._folder / "said").read_text(encoding="utf-8", errors="replace")
        last = [line.strip() for line in text.split("\n") if line.strip()]
        return f" (it printed: {last[-1][:160]})" if last else ""


def _end(process: Any, line: Connection, folder: Path) -> None:
    """Any: the type of a spawned process is that of its context."""
    line.close()
    process.join(_END_S)
    if process.is_alive():
        process.kill()
        process.join()
    rmtree(folder, ignore_errors=True)


def _serve(line: Connection, folder: Path) -> None:
    """In the other process: answer until the line is closed."""
    quiet(folder / "said")
    import fmpy

    instances: dict[int, Instance] = {}
    unpacked: dict[Path, Path] = {}
    while True:
        try:
            what, number, given = line.recv()
        except (EOFError, OSError):
            os._exit(0)  # an instance that is freed now may hang
        try:
            if what == "begin":
                if given.path not in unpacked:
                    target = folder / f"fmu-{len(unpacked)}"
                    unpacked[given.path] = Path(fmpy.extract(str(given.path), str(target)))
                instances[number] = Instance(given, unpacked[given.path])
                answer: object = None
            elif what == "end":
                instances.pop(number).end()
                answer = None
            else:
                answer = getattr(instances[number], what)(*given)
        except SimulationError as error:
            line.send((False, str(error)))
        except Exception as error:  # noqa: BLE001 - fmpy and foreign code raise anything
            text = " ".join(str(error).split())[:200] or type(error).__name__
            line.send((False, f"the FMU fails: {text}"))
        else:
            line.send((True, answer))
