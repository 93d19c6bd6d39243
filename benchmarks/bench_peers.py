"""Black boxes beside other tools: the same runs, the same cores, one after the other.

`python -m benchmarks.bench_peers PYTHON`: PYTHON is the interpreter of an environment with jax-sysid and sysidentpy,
which `make bench-peers` makes. A simulated damper with memory, 200 Hz, 2 000 samples to learn and 1 500 to show.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.blackbox import identify
from identification.models import motion_of
from tests.identification.hysteretic import hysteretic

PEERS = Path(__file__).with_name("peer_fits.py")


def main(asked: Sequence[str] = ()) -> int:
    """Prints a row for each tool; `asked` is the interpreter of the environment that has the others."""
    if not asked:
        print("no interpreter that has the other tools is named: `make bench-peers` makes one")
        return 0
    learned, shown = hysteretic(11, 2000), hysteretic(12, 1500)
    for turn in ("first", "second"):  # the first may compile the loops
        began, used = time.perf_counter(), time.process_time()
        found = identify("nnoe", [learned], held_out=[shown])
        row(
            f"nnoe, {turn} time",
            next(iter(found.shown.values())),
            time.perf_counter() - began,
            time.process_time() - used,
        )
    print(f"  predicted by cross-validation: {found.predicted:.1f} %")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arrays.npz"
        one, other = (np.column_stack([motion_of(run).x, motion_of(run).v]) for run in (learned, shown))
        np.savez(path, u=one, y=learned.channels["force"], u_shown=other, y_shown=shown.channels["force"])
        lines = subprocess.run([asked[0], str(PEERS), str(path)], capture_output=True, text=True, check=True).stdout
    for line in lines.splitlines():
        if line.startswith("{"):
            told = json.loads(line)
            row(told["tool"], told["fit"], told["seconds"], told["processor"])
    return 0


def row(name: str, fit: float, seconds: float, processor: float) -> None:
    """One tool."""
    result = f"fit {fit:6.2f} %" if fit > 0.0 else "diverges    "
    print(f"  {name:24s} {result}  {seconds:6.1f} s, {processor:6.1f} s of processors", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
