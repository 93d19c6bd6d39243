"""Ten minutes of streaming over CAN FD: memory of driver and rig, and no sample lost.

``python -m benchmarks.bench_rig_soak 60`` runs for a minute.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

from benchmarks.machine import a_rig, a_sine, memory_mb
from rigctl.player import PlayerSettings, connect, play
from rigctl.progress import Progress
from rigctl.runfile import read_run

LARGEST_MB = 4.0  # of growth between the second and the last tenth of the time
RATE_HZ = 2000.0


def main(seconds: float = 600.0) -> None:
    """Raises SystemExit where memory grew or a sample was lost."""
    with (
        a_rig(f"can://loopback/soak-{os.getpid()}?fd=true") as (url, rig),
        tempfile.TemporaryDirectory() as folder,
        closing(connect(url)) as wire,
    ):
        seen: list[tuple[int, float, float]] = []

        def look(progress: Progress) -> None:
            seen.append((progress.samples, memory_mb(os.getpid()), memory_mb(rig)))

        cpu, began = time.process_time(), time.perf_counter()
        test = a_sine(seconds, RATE_HZ)
        path = play(wire, test, Path(folder), on_progress=look, settings=PlayerSettings(ramp_s=0.5, report_s=1.0))
        cpu, took = time.process_time() - cpu, time.perf_counter() - began
        status, run = wire.status(2.0), read_run(path)
    table = np.array([row for row in seen if row[0] > 0.1 * test.excitation.samples])
    tenth = max(len(table) // 9, 1)
    growth = table[-tenth:, 1:].mean(axis=0) - table[:tenth, 1:].mean(axis=0)
    print(
        f"soak, {seconds:g} s at {RATE_HZ:g} Hz over CAN FD: {run.status}, {run.samples} samples, underruns "
        f"{status.underruns}, gaps {status.gaps}; driver {table[-1, 1]:.1f} MB, grew by {growth[0]:+.2f} MB; "
        f"rig {table[-1, 2]:.1f} MB, grew by {growth[1]:+.2f} MB; driver {100 * cpu / took:.0f} % of a core"
    )
    whole = run.samples == test.excitation.samples and not (status.underruns or status.gaps)
    if not whole or max(growth) > LARGEST_MB:
        raise SystemExit("memory grew, or samples were lost")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
