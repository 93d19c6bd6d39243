"""Import of a CSV of 1 GB and 10⁷ rows: time and memory beside pandas' own reader, each in a process of its own.

`python -c "import benchmarks.bench_import as b; b.main(rows=10**6)"` takes a tenth of it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROWS = 10_000_000
HEAD = "Time (s),Stroke command (mm),Stroke (mm),Force (N),Current (A),Oil temperature (C),Counter,Force (V)\n"
BLOCK = 100_000
ROUNDS = 3  # one after the other in turn, and the least of each: what else the computer does only adds
MOST_TIME, MOST_MEMORY = 2.0, 1.5  # times pandas' own reader

PANDAS = "import sys, pandas; print(len(pandas.read_csv(sys.argv[1])))"
IMPORT = "import sys; from api.cli.main import main; sys.exit(main(['import', sys.argv[1], '-o', sys.argv[2]]))"


def main(rows: int = ROWS) -> None:
    """Prints measured against goal; raises where a goal is missed."""
    with tempfile.TemporaryDirectory() as folder:
        path, run = Path(folder) / "large.csv", Path(folder) / "large.h5"
        _write(path, rows)
        print(f"{path.stat().st_size / 1e9:.2f} GB, {rows:,} rows, 8 columns, {os.cpu_count()} processors")
        _warm(path)
        rounds = [
            (
                _measured("pandas.read_csv", PANDAS, [str(path)]),
                _measured("damper-rig import", IMPORT, [str(path), str(run)]),
            )
            for _ in range(ROUNDS)
        ]
        print(f"run file: {run.stat().st_size / 1e9:.2f} GB")
    theirs, ours = ([min(turn[k][n] for turn in rounds) for n in range(3)] for k in range(2))
    print(f"time of processors: {ours[2] / theirs[2]:.2f} times that of pandas")
    met = [_row("time", ours[0] / theirs[0], MOST_TIME), _row("memory", ours[1] / theirs[1], MOST_MEMORY)]
    if not all(met):
        raise SystemExit("bench_import: a goal is missed")


def _write(path: Path, rows: int) -> None:
    """A dyno's log, 1 kHz, of which a block of 100 s is repeated but for its times."""
    t = np.arange(BLOCK) / 1000.0
    x = 25.0 * np.sin(2 * np.pi * 1.5 * t)
    force = 1500.0 * np.tanh(0.3 * np.cos(2 * np.pi * 1.5 * t)) + np.random.default_rng(1).normal(0.0, 3.0, BLOCK)
    rest = [
        f",{1.01 * a:.9f},{a:.9f},{b:.9f},{0.5:.9f},{25.0 + c:.9f},{k:06d},{b / 200:.12f}\n"
        for k, (a, b, c) in enumerate(zip(x.tolist(), force.tolist(), t.tolist(), strict=True))
    ]
    with path.open("w") as file:
        file.write(HEAD)
        for start in range(0, rows, BLOCK):
            file.writelines(f"{(start + k) / 1000.0:.6f}{line}" for k, line in enumerate(rest[: rows - start]))


def _warm(path: Path) -> None:
    """Read it once: both find it in the cache of the system."""
    with path.open("rb") as file:
        while file.read(1 << 24):
            pass


def _measured(name: str, code: str, arguments: Sequence[str]) -> tuple[float, float, float]:
    """Seconds, peak memory, MB, and seconds of processors of a process."""
    before = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", code, *arguments], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    elapsed = time.perf_counter() - before
    if process.returncode:
        raise SystemExit(f"{name}: ended with status {process.returncode}")
    peak_mb = used.ru_maxrss / (1024 if sys.platform != "darwin" else 2**20)
    busy = used.ru_utime + used.ru_stime
    print(f"{name}: {elapsed:.1f} s, {peak_mb:.0f} MB at its peak, {busy:.1f} s of processors", flush=True)
    return elapsed, peak_mb, busy


def _row(what: str, ratio: float, most: float) -> bool:
    print(
        f"{what}: {ratio:.2f} times that of pandas   goal ≤ {most:g}: {'met' if ratio <= most else 'MISSED'}",
        flush=True,
    )
    return ratio <= most


if __name__ == "__main__":
    main()
