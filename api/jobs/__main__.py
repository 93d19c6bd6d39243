"""The process of a job, ``python -m api.jobs``; its task is a line of JSON on standard input.

It writes lines of JSON: ``{"done": 0.4, "text": "…"}`` for progress, then ``{"result": {…}}``, ``{"refused": "…"}``
where its input cannot be used, or ``{"failed": "…"}``. It ends when standard input closes, as it does when the service
dies.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

__all__ = ["main"]

_NICE = 10  # lower priority than rig control


def main() -> int:
    """Do the task and write its result or its error; returns 0."""
    from api.errors import one_line, outcome_of
    from api.processes.limits import JOB_DIES_FIRST, die_first, limit
    from api.processes.parent import end_with_parent

    if hasattr(os, "nice"):
        os.nice(_NICE)
    die_first(JOB_DIES_FIRST)
    given = json.loads(sys.stdin.readline())
    end_with_parent()
    most = int(given["memory_bytes"])
    if most and sys.platform == "linux":  # of what the process writes to, not of what it maps; elsewhere without effect
        limit("RLIMIT_DATA", most)
    try:
        _say({"result": _do(given)})
    except MemoryError:
        _say(
            {
                "refused": f"it needs more than {most / 1e9:.3g} GB of memory: give fewer or shorter runs, or an "
                "administrator raises job_memory_bytes"
            }
        )
    except Exception as error:  # noqa: BLE001 - the last handler: the service reports any error
        outcome = outcome_of(error)
        if outcome is not None and outcome.http_status < 500:
            _say({"refused": one_line(error)})
        else:
            _say({"failed": f"{type(error).__name__}: {one_line(error)}"})
    return 0


def _do(given: dict[str, Any]) -> dict[str, Any]:
    # Any: JSON, made by api.jobs.process
    from api.jobs.kind import Task
    from api.jobs.kinds import find_kind
    from identification.compute import chosen
    from identification.studies.journal import kept

    kind = find_kind(given["kind"])
    task = Task(
        request=given["request"],
        runs=tuple(map(Path, given["runs"])),
        held_out=tuple(map(Path, given["held_out"])),
    )
    if not given["folder"]:
        kind.check(task)
        return {}
    folder = Path(given["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    journal = Path(given["journal"]) if given["journal"] else None
    with chosen(os.environ), kept(journal):
        return kind.run(task, folder, lambda done, text: _say({"done": done, "text": text}))


def _say(line: dict[str, Any]) -> None:
    print(json.dumps(line), flush=True)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    os._exit(status)  # does not wait for the thread that watches the parent
