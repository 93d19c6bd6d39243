"""One record cut in two: 2 000 samples are learned, 1 500 shown in free run; of a shorter one four sevenths, the rest.

`python -m benchmarks.bench_cuts [FOLDER]`: the measured runs below a folder (run files, and a recorder's text files) at
no more than 200 Hz, without the current; then simulated dampers in a random motion. `limit` is the fit that a model
without any error could have: of a simulated record by its noise, of a measured one by how well its cycles repeat.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.bench_blackbox import LEARNED, part
from benchmarks.machines.measured import whole
from benchmarks.random_dampers import Record, records
from identification.blackbox import identify
from identification.blackbox.folds import FOLDS, SHORTEST
from identification.blackbox.preparation import resampled
from rigctl.runfile import Run, read_run

Floats = NDArray[np.float64]

RATE_HZ, MOST, MOST_LEARNED = 200.0, 3500, 2000
_LEAST = FOLDS * SHORTEST  # learned samples
_ALIKE = 0.1  # of the usual travel: cycles of another are those of a machine that starts or stops
_SAME_MOTION = 98.0  # %, of the displacement: where its cycles differ, those of the force must
_PHASES, _FEWEST = 200, 3  # points of a cycle, cycles


def main(paths: list[str]) -> int:
    """Prints a row for each record, and the means."""
    groups = {"measured": list(measured(Path(paths[0]))) if paths else [], "simulated": list(records())}
    print("  record                          predicted   came out    limit   processors, and by the clock")
    for group, every in groups.items():
        figures = np.array([row(one) for one in every if learned(one.run) >= _LEAST])
        if figures.size:
            predicted, came, limit, used, took = figures.T
            print(
                f"  {group}: {len(came)} records, predicted {predicted.mean():.1f} %, came out {came.mean():.1f} %, "
                f"lowest {came.min():.1f} %, 94 % or more on {np.sum(came >= 94.0)}; limit below 96 % on "
                f"{np.sum(limit < 96.0)}; {_times(used)} of processors, {_times(took)} by the clock"
            )
    return 0


def learned(run: Run) -> int:
    """How many samples of a record are learned."""
    return MOST_LEARNED if run.samples >= MOST else round(LEARNED * run.samples)


def _times(seconds: Floats) -> str:
    median, late = np.quantile(seconds, [0.5, 0.95])
    return f"median {median:.1f}, 95th percentile {late:.1f}, largest {seconds.max():.1f} s"


def row(one: Record) -> tuple[float, float, float, float, float]:
    """Predicted fit, fit that came out, and its limit, %; seconds of processors, and by the clock."""
    middle = learned(one.run)
    began, clock = time.process_time(), time.perf_counter()
    shown = part(one.run, middle, min(one.run.samples, MOST))
    found = identify("nnoe", [part(one.run, 0, middle)], held_out=[shown])
    (fit,) = found.shown.values()
    used, took = time.process_time() - began, time.perf_counter() - clock
    print(
        f"  {one.run.run_id:32s} {found.predicted:6.2f} %   {fit:6.2f} %   {one.limit:6.2f} %  {used:5.1f} s "
        f"{took:5.1f} s",
        flush=True,
    )
    return found.predicted, fit, one.limit, used, took


def measured(folder: Path) -> Iterator[Record]:
    """The measured runs without their current, no faster than 200 Hz."""
    for path in sorted(folder.rglob("*.h5")):
        yield at_most(replace(read_run(path), run_id=f"{path.parent.name} {path.stem}"))
    for path in sorted(folder.rglob("*.csv")):
        yield at_most(whole(path))


def at_most(run: Run) -> Record:
    """A run as a record, at 200 Hz where it was faster."""
    kept = {name: run.channels[name] for name in ("displacement", "force")}
    plain = replace(run, channels=kept, units={name: run.units[name] for name in kept}, path=None)
    slow = plain if run.sample_rate_hz <= RATE_HZ else resampled(plain, RATE_HZ)
    return Record(slow, repeats(slow.channels["displacement"][:MOST], slow.channels["force"][:MOST]))


def repeats(x: Floats, force: Floats) -> float:
    """The fit of the mean cycle of the force to every cycle, %; NaN below three cycles, or where the motion differs.

    A cycle begins where the displacement passes its middle upwards; those of another travel than most are left out.
    """
    middle = 0.5 * (np.max(x) + np.min(x))
    up = np.flatnonzero((x[:-1] < middle) & (x[1:] >= middle))
    ends = list(pairwise(up + (middle - x[up]) / (x[up + 1] - x[up])))
    travels = np.array([np.ptp(x[int(first) : int(last) + 1]) for first, last in ends])
    alike = [one for one, t in zip(ends, travels, strict=True) if abs(t / np.median(travels) - 1.0) <= _ALIKE]
    if len(alike) < _FEWEST or _repeats(x, alike) < _SAME_MOTION:
        return float("nan")
    return _repeats(force, alike)


def _repeats(series: Floats, ends: Sequence[tuple[float, float]]) -> float:
    grid = np.linspace(0.0, 1.0, _PHASES, endpoint=False)
    cycles = np.array([np.interp(a + grid * (b - a), np.arange(series.size), series) for a, b in ends])
    apart = cycles - cycles.mean(axis=0)
    spread = float(np.sqrt(np.sum(apart**2) / (len(cycles) - 1) / _PHASES))
    return 100.0 * (1.0 - spread / float(np.std(cycles)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
