"""A process that reads one run or plan file from elsewhere, ``python -m api.processes.read_run_file``, and ends.

It takes one line of JSON, the path, the name to show and what is wanted, and writes one: ``{"run": {…}}``,
``{"plan": {…}}`` or ``{"refused": "…"}``. Behind the line of a plan follow the channels of its excitations, float64.
Before it opens the file it gives up everything that reading does not need. It waits for its line: a spare one is ready.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Final

from api.processes.limits import DATA_DIES_FIRST, die_first, limit
from api.processes.plan_content import channels_of, plan_content
from excitation.errors import ExcitationError
from excitation.signal import Excitation
from excitation.untrusted import Limits
from rigctl.errors import RunFileError
from rigctl.runfile import Run, read_run

__all__ = ["MOST_DATA_BYTES", "main"]

# All channels of an uploaded run in memory: as much as the largest uploaded file without compression.
MOST_DATA_BYTES: Final = 512 << 20
# Beside what the process has before: the channels, once more one channel while it is converted, and a mark a sample.
MEMORY_BYTES: Final = 5 * MOST_DATA_BYTES // 2
CPU_S: Final = 30  # reading and unpacking 512 MiB takes some 5 s
OPEN_FILES: Final = 16  # three, the run file twice, and what Python opens for a moment
_SIZE: Final = Path("/proc/self/statm")
MOST_TEXT: Final = 200  # characters of a specimen, as in a campaign


def main() -> int:
    """Read the file that standard input names and write what it is; returns 0."""
    line = sys.stdin.buffer.readline()
    if not line:  # the service has ended
        return 0
    given = json.loads(line)
    _give_up()
    answer, excitations = _answer(Path(given["path"]), given["name"], given["what"])
    out = sys.stdout.buffer
    out.write(json.dumps(answer).encode() + b"\n")
    for excitation in excitations:
        for values in channels_of(excitation):
            out.write(values.data)
    out.flush()
    return 0


def _answer(path: Path, name: str, what: str) -> tuple[dict[str, object], list[Excitation]]:
    try:
        if what == "plan":
            content, excitations = plan_content(path)
            return {"plan": content}, excitations
        run = read_run(path, limits=Limits(most_bytes=MOST_DATA_BYTES))
        return {"run": _summary(run, name)}, []
    except (RunFileError, ExcitationError) as error:
        return {"refused": str(error).replace(str(path), name)[:1000]}, []


def _summary(run: Run, name: str) -> dict[str, object]:
    if len(run.specimen) > MOST_TEXT or not (run.specimen.isprintable() or not run.specimen):
        raise RunFileError(
            f"{name}: attribute specimen is {run.specimen!a:.60}: it must be at most {MOST_TEXT} printable characters"
        )
    return {
        "specimen": run.specimen,
        "test": run.test_id if run.test_id.isprintable() and len(run.test_id) <= MOST_TEXT else "",
        "status": run.status,
        "samples": run.samples,
        "sample_rate_hz": run.sample_rate_hz,
    }


def _give_up() -> None:
    """Memory, time, files, writing and priority; where the system has no such limits, only the deadline is left."""
    if hasattr(os, "nice"):
        os.nice(10)
    die_first(DATA_DIES_FIRST)
    wanted = {"RLIMIT_CPU": CPU_S, "RLIMIT_FSIZE": 0, "RLIMIT_CORE": 0, "RLIMIT_NOFILE": OPEN_FILES}
    if _SIZE.exists():
        has = int(_SIZE.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        wanted["RLIMIT_AS"] = has + MEMORY_BYTES
    for name, value in wanted.items():
        limit(name, value)


if __name__ == "__main__":
    sys.exit(main())
