"""Runs that were measured on real machines, from a folder: one set for each machine and setting.

Run files (``*.h5``) of one folder are one set. A recorder's text file (``*.csv``, with time stamps, force and
displacement) is a set of its own, cut into pieces. Every set is tared: the mean of its force is taken off. No data are
part of the project.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from benchmarks.machines.bases import Seen
from benchmarks.machines.simulation import Motion
from rigctl.runfile import Run, read_run

Row = NDArray[np.float64]

LEAST_RUNS = 3
PIECES, PIECE_S = 6, 3.0  # of a text file: at most so many, each so long
HARMONICS = 12.0  # of the motion that its derivatives keep


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredSet:
    """Runs of one machine at one setting."""

    name: str
    runs: tuple[Run, ...]


def measured_sets(folder: Path) -> list[MeasuredSet]:
    """All sets below a folder with three runs or more, by name; none where the folder is missing."""
    if not folder.is_dir():
        return []
    sets = []
    for place in sorted({p.parent for p in folder.rglob("*.h5")}):
        runs = tuple(read_run(p) for p in sorted(place.glob("*.h5")))
        sets.append(MeasuredSet(name=str(place.relative_to(folder)), runs=_tared(runs)))
    for path in sorted(folder.rglob("*.csv")):
        sets.append(MeasuredSet(name=str(path.relative_to(folder).with_suffix("")), runs=_tared(pieces(path))))  # noqa: PERF401
    return [s for s in sets if len(s.runs) >= LEAST_RUNS]


def _tared(runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """The runs without the mean force of them all."""
    zero = float(np.mean(np.concatenate([r.channels["force"] for r in runs])))
    return tuple(replace(r, channels={**r.channels, "force": r.channels["force"] - zero}, path=None) for r in runs)


def pieces(path: Path) -> tuple[Run, ...]:
    """A recorder's text file, see `whole`, cut into pieces."""
    run = whole(path)
    size = int(PIECE_S * run.sample_rate_hz)
    starts = range(0, run.samples - size + 1, max(size, (run.samples - size) // PIECES))
    return tuple(
        replace(run, run_id=f"{path.stem}-{k}", channels={n: v[s : s + size] for n, v in run.channels.items()})
        for k, s in enumerate(starts)
    )


def whole(path: Path) -> Run:
    """A recorder's text file on even time steps, with the sign of a damper."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    stamps = [datetime.fromisoformat(row["Timestamp"]) for row in rows]
    t = np.array([(s - stamps[0]).total_seconds() for s in stamps])
    rate = round(1.0 / float(np.median(np.diff(t))))
    even = np.arange(0.0, t[-1], 1.0 / rate)
    columns = {"displacement": ("Displacement (mm)", 1e-3), "force": ("Force (N)", 1.0),
               "temperature": ("Temperature (C)", 1.0)}  # fmt: skip
    channels = {
        name: np.interp(even, t, [scale * float(row[column]) for row in rows])
        for name, (column, scale) in columns.items()
    }
    if np.sum(np.gradient(channels["displacement"]) * channels["force"]) < 0.0:
        channels["force"] = -channels["force"]
    return Run(
        run_id=path.stem, created="2026-01-01T00:00:00+00:00", specimen=path.stem, sample_rate_hz=float(rate),
        period_samples=0, excitation_kind="custom", status="complete", channels=channels,
        units={"displacement": "m", "force": "N", "temperature": "degC"},
    )  # fmt: skip


def motion_of(run: Run) -> Motion:
    """Displacement without its noise, speed and acceleration, to the twelfth harmonic of the motion."""
    x = run.channels["displacement"]
    rate = run.sample_rate_hz
    smooth = _low_passed(x, _keeps(x, rate), rate)
    v = np.gradient(smooth, 1.0 / rate)
    zero = np.zeros(x.size)
    return Motion(
        x=smooth, v=v, a=np.gradient(v, 1.0 / rate), current=run.channels.get("current", zero),
        temperature=run.channels.get("temperature", zero + 25.0), fine=1, rate_hz=rate, lead=0,
    )  # fmt: skip


def noise_of(run: Run) -> float:
    """Noise of the force, N: what is above the harmonics of the motion, as white noise."""
    force, rate = run.channels["force"], run.sample_rate_hz
    cut = min(2.5 * _keeps(run.channels["displacement"], rate), 0.4 * rate)
    left = force - _low_passed(force, cut, rate)
    return float(np.std(left) / np.sqrt(1.0 - 2.0 * cut / rate))


def _keeps(x: Row, rate_hz: float) -> float:
    """Up to which frequency the displacement is motion, Hz."""
    spectrum = np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(x.size)))
    main = float(np.fft.rfftfreq(x.size, 1.0 / rate_hz)[int(np.argmax(spectrum))])
    return min(HARMONICS * max(main, 2.0 * rate_hz / x.size), 0.3 * rate_hz)


def _low_passed(row: Row, cut_hz: float, rate_hz: float) -> Row:
    return np.asarray(sosfiltfilt(butter(4, 2.0 * cut_hz / rate_hz, output="sos"), row))


def seen_of(run: Run, motion: Motion) -> Seen:
    """The run as a model is given it."""
    still = np.abs(motion.v) < 0.01 * np.max(np.abs(motion.v))
    near = np.convolve(~still, np.ones(2 * max(1, int(0.1 * motion.rate_hz)) + 1), mode="same") > 0.5
    return Seen(
        x=motion.x, v=motion.v, a=motion.a, i=motion.current, warm=motion.temperature,
        t=np.arange(motion.x.size) / motion.rate_hz, moving=near, force=run.channels["force"],
    )  # fmt: skip
