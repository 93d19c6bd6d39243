"""What bands hold of motions and currents that were never learned: measured runs, of which some are held out whole.

`python -m benchmarks.bench_bands FOLDER [KIND]`: of the UTFPR runs of one voltage the three of the smallest, largest
and middle stroke are shown by the others; of the UTFSM runs of one current each sine by the other three; and, with the
current, all runs of one current by those of the others. At no more than 200 Hz; `mlp` where no kind is named.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.bench_cuts import RATE_HZ
from identification.blackbox import identify, resampled
from identification.models.band import covered, half_width_of
from identification.models.simulation import checked_motion, for_every_sample, simulate_run
from rigctl.runfile import Run, read_run

LEVELS = (0.5, 0.9)
CURRENT_A = {"I0A": 0.0, "I0p25A": 0.25, "I0p5A": 0.5, "I0p75A": 0.75, "I1A": 1.0}
Case = tuple[str, list[Run], list[Run]]
"""Its name, what is learned, and what is shown."""


def main(asked: Sequence[str] = ()) -> int:
    """Prints a row for each case, and the means of each group."""
    if not asked:
        print("no folder with measured runs is named")
        return 0
    folder, kind = Path(asked[0]), asked[1] if len(asked) > 1 else "mlp"
    for group in (strokes, sines, currents):
        figures = np.array([row(kind, *case) for case in group(folder)])
        fits, shares = figures[:, :2].mean(axis=0), figures[:, 2:]
        print(
            f"  {group.__name__}: {len(figures)} cases; fit {fits[0]:.1f} % predicted, {fits[1]:.1f} % came out; "
            f"a band of 50 % holds {shares[:, 0].mean():.1f} %, one of 90 % {shares[:, 1].mean():.1f} %, at the lowest "
            f"{shares[:, 1].min():.0f} %"
        )
    return 0


def row(kind: str, name: str, learned: Sequence[Run], shown: Sequence[Run]) -> tuple[float, ...]:
    """Fit predicted and come out, and the shares within the band of each level, on average over the runs shown, %."""
    found = identify(kind, learned, held_out=shown)
    fit, shares = float(np.mean(list(found.shown.values()))), []
    for level in LEVELS:
        held = []
        for one in shown:
            motion = checked_motion(found.model, one)
            half = half_width_of(found.model, motion, level)
            assert half is not None  # every kind was calibrated
            force = simulate_run(found.model, one)
            held.append(covered(one.channels["force"], force, for_every_sample(half, motion, one)))
        shares.append(100.0 * float(np.mean(held)))
    print(
        f"  {name:32s} {found.predicted:6.1f} % → {fit:6.1f} %; of 50 and 90 %: "
        + ", ".join(f"{s:.0f}" for s in shares),
        flush=True,
    )
    return found.predicted, fit, *shares


def strokes(folder: Path) -> Iterator[Case]:
    """Three of the smallest, largest and middle strokes of each voltage, by the others."""
    for place in sorted((folder / "mr_utfpr").iterdir()):
        runs = sorted(map(at_most, place.glob("*.h5")), key=lambda one: float(np.ptp(one.channels["displacement"])))
        for name, first in (("smallest", 0), ("middle", 2), ("largest", len(runs) - 3)):
            yield f"{place.name} {name}", runs[:first] + runs[first + 3 :], runs[first : first + 3]


def sines(folder: Path) -> Iterator[Case]:
    """Each sine of a current, by the others."""
    for name in CURRENT_A:
        runs = [at_most(path) for path in sorted((folder / "mr_utfsm").glob(f"{name}_*.h5"))]
        for k, one in enumerate(runs):
            yield one.run_id, runs[:k] + runs[k + 1 :], [one]


def currents(folder: Path) -> Iterator[Case]:
    """The runs of one current by those of the others: all sines, and three of them alone."""
    for sine in ("", "10mm2Hz", "25mm0p25Hz", "5mm3Hz"):
        runs = {
            name: [at_most(path, current) for path in sorted((folder / "mr_utfsm").glob(f"{name}_{sine}*.h5"))]
            for name, current in CURRENT_A.items()
        }
        for name in CURRENT_A:
            yield f"{name} {sine}", [one for other in CURRENT_A if other != name for one in runs[other]], runs[name]


def at_most(path: Path, current_a: float | None = None) -> Run:
    """Displacement and force of a run, at no more than 200 Hz; with a current that was held, where one is stated."""
    run = read_run(path)
    channels = {name: run.channels[name] for name in ("displacement", "force")}
    units = {name: run.units[name] for name in channels}
    if current_a is not None:
        channels["current"], units["current"] = np.full(run.samples, current_a), "A"
    plain = replace(run, run_id=path.stem, channels=channels, units=units, path=None)
    return plain if run.sample_rate_hz <= RATE_HZ else resampled(plain, RATE_HZ)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
