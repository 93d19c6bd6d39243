"""Outcomes of many cases, one line of JSON each: worked out in parallel, kept as they come."""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.explain.judge import Outcome
from identification.compute import (
    EXECUTOR,
    Executor,
    Processes,
    available_workers,
    executor_from,
    finished,
    using,
    workers_from,
)


def read(path: Path) -> list[Outcome]:
    """Outcomes so far, of a file that may be compressed; a last line that an interruption cut short is left out."""
    if not path.exists():
        return []
    text = gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text(encoding="utf-8")
    lines = text.splitlines()
    return [json.loads(line) for line in lines if line.endswith("}")]


def collect(
    judge: Callable[..., Outcome],
    todo: Sequence[tuple[Any, ...]],
    path: Path,
    executor: Executor,
    in_a_line: Callable[[Outcome], str],
) -> None:
    """Append `judge(*arguments)` to `path` for all of `todo`, in parallel, and print each in a line.

    The first that raises ends it: nobody would keep what the others still come to.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file, using(executor):
        for number, (_, outcome) in enumerate(finished(partial(_judged, judge=judge), todo), 1):
            file.write(json.dumps(outcome) + "\n")
            file.flush()
            print(f"{number}/{len(todo)} {in_a_line(outcome)}", flush=True)


def executor_for_cases(workers: int | None = None) -> Executor:
    """The executor that the environment asks for; else as many processes as workers, which share the processors."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the processes that are started: as in every command
    if EXECUTOR in os.environ:
        return executor_from(os.environ)
    count = workers or workers_from(os.environ)
    return Processes(count, threads_each=max(1, available_workers() // count))


def _judged(arguments: tuple[Any, ...], judge: Callable[..., Outcome]) -> Outcome:
    return judge(*arguments)
