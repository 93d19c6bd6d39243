"""The current for a wanted force, learned and by inversion of a forward model: on a simulated MR specimen, and on runs.

`python -m benchmarks.bench_inverse [RUN.h5 …]`: with runs of one specimen at several currents every fifth one is held
out. The simulated specimen is played again with the current that was found: what it then gives is the true tracking.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.blackbox import Base, identify
from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_to_json
from identification.fitting import simple_base
from identification.inverse import Limits, Tracking, identify_inverse, track, wanted_of
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run, read_run, with_channel
from sim_rig.plant import SimulatedPlant
from sim_rig.sensors import Noise
from sim_rig.specimens import MR_DISTORTION

Floats = NDArray[np.float64]
RATE_HZ = 200.0
SECONDS = 6.0
SHOWN = (20, 21)  # seeds that nothing was chosen by
LIMITS = Limits(0.0, 1.0)  # A, of the specimen


def main(paths: Sequence[str]) -> int:
    """Prints a table for the simulated specimen, and one for the runs."""
    simulated()
    if paths:
        runs = sorted((read_run(Path(path)) for path in paths), key=lambda one: one.path.name if one.path else "")
        measured(runs)
    return 0


def simulated() -> None:
    """Wanted: the force of held-out runs; and half of it more, of which much cannot be made."""
    training, shown = [specimen_run(seed) for seed in range(4)], [specimen_run(seed) for seed in SHOWN]
    for label, forward in forwards(training):
        inverse, took = learned(training, forward)
        for name, scale in (("as measured", 1.0), ("half more", 1.5)):
            found: dict[bool, list[tuple[Tracking, float]]] = {True: [], False: []}
            for seed, run in zip(SHOWN, shown, strict=True):
                run = with_channel(run, "force_wanted", scale * run.channels["force"], "N")
                for way, rows in found.items():
                    tracked = track(inverse, wanted_of(run, forward.model), LIMITS, learned=way)
                    again = specimen_run(seed, current=tracked.current)
                    rows.append((tracked, fit(tracked.wanted, again.channels["force"], ~tracked.cannot)))
            for way, rows in found.items():
                print_row(f"simulated, {label}, {name}", "learned" if way else "inverted", [one for one, _ in rows],
                          f"true {np.mean([true for _, true in rows]):6.2f} %, identified in {took:.1f} s")  # fmt: skip


def measured(runs: Sequence[Run]) -> None:
    """Wanted: the measured force of held-out runs."""
    held = [one for k, one in enumerate(runs) if k % 5 == 2]
    training = [one for one in runs if all(one is not other for other in held)]
    for label, forward in forwards(training):
        inverse, took = learned(training, forward)
        limits = inverse.limits
        for way in (True, False):
            rows = [track(inverse, wanted_of(one, forward.model), limits, learned=way) for one in held]
            off = [float(np.sqrt(np.mean((row.current - one.channels["current"][: row.current.size]) ** 2)))
                   for row, one in zip(rows, held, strict=True)]  # fmt: skip
            print_row(f"measured, {label}", "learned" if way else "inverted", rows,
                      f"current {np.mean(off):.3f} A rms off, identified in {took:.1f} s")  # fmt: skip


def print_row(case: str, way: str, rows: Sequence[Tracking], rest: str) -> None:
    """One line: fit through the forward model, over what can be made, and how much cannot."""
    fits = np.mean([one.fit_where_it_can for one in rows])
    cannot = 100.0 * np.mean([one.share_cannot for one in rows])
    print(
        f"  {case:42s} {way:9s} tracked {fits:6.2f} % of what can be made, {cannot:5.1f} % cannot; {rest}", flush=True
    )


def forwards(training: Sequence[Run]) -> list[tuple[str, Base]]:
    """A network, and a physical model, as forward models."""
    network = identify("nnoe", training).model
    assert isinstance(network, BlackBox)
    physical = simple_base(training)
    return [
        ("network", Base(network, blackbox_to_json(network))),
        ("physical", Base(physical, model_to_json(physical))),
    ]


def learned(training: Sequence[Run], forward: Base):  # type: ignore[no-untyped-def]
    """The inverse, and the seconds that it took."""
    began = time.process_time()
    found = identify_inverse(training, forward)
    return found.model, time.process_time() - began


def fit(wanted: Floats, given: Floats, counted: NDArray[np.bool_]) -> float:
    """Fit in % over the samples that count."""
    y = wanted[counted]
    return 100.0 * (1.0 - float(np.linalg.norm(y - given[counted]) / np.linalg.norm(y - y.mean())))


def specimen_run(seed: int, *, current: Floats | None = None) -> Run:
    """A run of the specimen with a random displacement and a random current, or that displacement and a given one."""
    rng = np.random.default_rng([77, seed])
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    x = tones(rng, t, 0.4, 6.0, 20, fall=1.0)
    x *= 0.018 / np.max(np.abs(x))
    own = tones(rng, t, 0.1, 4.0, 12, fall=0.0)
    own = np.clip(0.5 + 0.5 * own / (1.7 * np.std(own)), LIMITS.low, LIMITS.high)
    plant = SimulatedPlant(MR_DISTORTION.damper, Noise(force_n=2.0), seed=seed, start_degc=25.0)
    plant.set_rate(RATE_HZ)
    plant.begin_run()
    ramp = np.linspace(0.0, 1.0, int(RATE_HZ))
    used = own if current is None else current
    lead = np.column_stack([ramp * x[0], np.full(ramp.size, used[0])])
    plant.play(lead)
    read = plant.play(np.column_stack([x, used]))
    force, displacement, amperes, degc = read[:, 0], read[:, 1], read[:, 2], read[:, 3]
    return Run(
        run_id=f"mr-{seed}", created="2026-01-01T00:00:00+00:00", specimen="mr-distortion", sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete",
        channels={"displacement": displacement, "force": force, "current": amperes, "temperature": degc},
        units={"displacement": "m", "force": "N", "current": "A", "temperature": "degC"},
    )  # fmt: skip


def tones(rng: np.random.Generator, t: Floats, low_hz: float, high_hz: float, count: int, *, fall: float) -> Floats:
    """A sum of tones whose size falls with the frequency."""
    hz = rng.uniform(low_hz, high_hz, count)
    turns = np.multiply.outer(t, 2.0 * np.pi * hz) + rng.uniform(0.0, 2.0 * np.pi, count)
    return np.asarray(np.sin(turns) @ hz**-fall)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
