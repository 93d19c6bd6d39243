"""Outcomes of many cases, one line of JSON each: worked out in parallel, kept as they come."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from benchmarks.explain.judge import Outcome


def read(path: Path) -> list[Outcome]:
    """Outcomes so far; a last line that an interruption cut short is left out."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [json.loads(line) for line in lines if line.endswith("}")]


def collect(
    judge: Callable[..., Outcome],
    todo: Sequence[tuple[Any, ...]],
    path: Path,
    workers: int,
    in_a_line: Callable[[Outcome], str],
) -> None:
    """Append `judge(*arguments)` to `path` for all of `todo`, in parallel, and print each in a line.

    The first that raises ends it: nobody would keep what the others still come to.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with (
        ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_end_with_parent) as pool,
        path.open("a", encoding="utf-8") as file,
    ):
        waiting = [pool.submit(judge, *arguments) for arguments in todo]
        try:
            for number, done in enumerate(as_completed(waiting), 1):
                outcome = done.result()
                file.write(json.dumps(outcome) + "\n")
                file.flush()
                print(f"{number}/{len(todo)} {in_a_line(outcome)}", flush=True)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _end_with_parent() -> None:
    """A worker must not go on for hours when whoever would keep its outcomes was killed."""

    def watch() -> None:
        if parent := parent_process():
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()
