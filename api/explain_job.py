"""One explanation as a process of its own: ``python -m api.explain_job``, its task a line of JSON on standard input.

It answers with lines of JSON: ``{"done": 0.4, "text": "…"}`` on the way, then what it found, ``{"refused": "…",
"status": 422}`` or ``{"failed": "…"}``. It ends when standard input closes: when the service has died.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

__all__ = ["main"]

_NICE = 10  # a rig that is being driven comes first


def main() -> int:
    """Do the task; 0 where there is an answer, whatever it is."""
    from api.cli.parent import end_with_parent
    from api.errors import one_line, outcome_of

    if hasattr(os, "nice"):
        os.nice(_NICE)
    task = json.loads(sys.stdin.readline())
    end_with_parent()
    try:
        _say(_done(task))
    except Exception as error:  # noqa: BLE001 - the last door of this process: the service tells what it was
        outcome = outcome_of(error)
        if outcome is not None and outcome.http_status < 500:
            _say({"refused": one_line(error), "status": outcome.http_status})
        else:
            _say({"failed": f"{type(error).__name__}: {one_line(error)}"})
    return 0


def _done(task: dict[str, Any]) -> dict[str, Any]:
    # Any: JSON, made by api.explain_process and nobody else
    from identification.compute import chosen
    from identification.discrepancy import explain, prepared, report_data, write_report
    from identification.physical.modelfile import model_from_json
    from rigctl.runfile import read_run

    model = None if task["model"] is None else model_from_json(task["model"])
    runs, held_out = ([read_run(path) for path in task[key]] for key in ("runs", "held_out"))
    if not task["output"]:
        prepared(model, runs, held_out or None)
        return {"refused": ""}
    with chosen(os.environ):
        found = explain(
            model, runs, held_out or None, on_progress=lambda text, done: _say({"done": done, "text": text})
        )
    write_report(found, Path(task["output"]), reproduce=task["reproduce"])
    report = report_data(found)
    return {"verdict": report["verdict"], "effects": [[e["element"], e["confidence"]] for e in report["effects"]]}


def _say(line: dict[str, Any]) -> None:
    print(json.dumps(line), flush=True)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    os._exit(status)  # the thread that waits for the parent's end must not hold this one up
