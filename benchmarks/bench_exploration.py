"""An exploration of 800 samples over 30 tests: its time, its error against a fine solution, the page.

`python -m benchmarks.bench_exploration [PAGE.html]`. Goal: 40 s on two cores (stretch: 10 s) for 6 000 points a test,
within 1e-6 of a fine solution. As the limit stands a C loop for one sample after the other.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.bench_solver import N, a_motion, call, compiled, timed
from benchmarks.yaw_tests import VARIED, guessed, thirty_tests
from identification.compute import Processes, Threads, available_workers, using
from identification.physical.model import Model
from identification.studies.exploration import Exploration, explore, explored_text, write_explored
from identification.studies.exploration.asked import sampled
from identification.studies.exploration.simulating import CYCLES, lane_forces
from identification.studies.exploration.sine_tests import sine_tests
from rigctl.runfile import Run

Floats = NDArray[np.float64]

GOAL_S, GOAL_ERROR, FINE = 40.0, 1e-6, 8


def main(arguments: Sequence[str] = ()) -> int:
    """Prints the figures; with an argument, writes the page."""
    model, runs, asked = guessed(), thirty_tests(), Exploration(vary=VARIED)
    explore(model, runs[:1], replace(asked, samples=16, points=100))  # compiled
    answers = []
    for make in (Threads, Processes):
        executor = make(available_workers())
        with using(executor):
            began = time.perf_counter()
            answers.append(explore(model, runs, asked))
            took = time.perf_counter() - began
        executor.close()
        count = asked.samples * len(runs) * CYCLES * asked.points
        print(
            f"  {asked.samples} samples × {len(runs)} tests × at least {CYCLES * asked.points} points on "
            f"{available_workers()} {make.__name__.lower()}: {took:.1f} s, {took / count * 1e9:.1f} ns/sample, "
            f"goal {GOAL_S:g} s: {'met' if took <= GOAL_S else 'MISSED'}",
            flush=True,
        )
    same = answers[0].figures.tobytes() == answers[1].figures.tobytes()
    print(f"  threads and processes: {'the same to the bit' if same else 'DIFFERENT'}")
    errors(model, runs, asked)
    in_c(model)
    print(explored_text(answers[0]))
    if arguments:
        write_explored(Path(arguments[0]), answers[0])
    return 0 if same else 1


def errors(model: Model, runs: Sequence[Run], asked: Exploration) -> None:
    """Error of force and figures of 16 samples over all tests, against eight times as many points."""
    values = sampled(model, replace(asked, samples=16))
    coarse, fine = (sine_tests(runs, points)[0] for points in (asked.points, FINE * asked.points))
    force, figures = 0.0, np.zeros(3)
    for one, other in zip(coarse, fine, strict=True):
        mine, exact = lane_forces(model, values, one), lane_forces(model, values, other)
        apart = np.sqrt(np.mean((mine - exact[::FINE]) ** 2, axis=0) / np.mean(exact**2, axis=0))
        force = max(force, float(apart.max()))
        figures = np.maximum(figures, np.abs(one.figures(mine) / other.figures(exact) - 1.0).max(axis=0))
    met = "met" if max(force, *figures) <= GOAL_ERROR else "MISSED"
    print(
        f"  greatest error: force {force:.1e} rms, stiffness {figures[0]:.1e}, loss angle {figures[1]:.1e}, shape "
        f"{figures[2]:.1e}, goal {GOAL_ERROR:g}: {met}"
    )


def in_c(model: Model) -> None:
    """Nanoseconds a sample of a C loop for one parameter set."""
    if shutil.which("gcc") is None:
        print("  gcc is missing: there is no C loop to compare with")
        return
    values = dict(zip(model.names(), model.values(), strict=True))
    order = ("arctan_damping.F1", "arctan_damping.S", "arctan_damping.d", *VARIED)
    with tempfile.TemporaryDirectory() as folder:
        run = call(compiled(Path(folder)), "enriched", a_motion(), [values[name] for name in order], np.zeros(N))
        print(f"  the C loop of bench_solver, one set at a time: {timed(run, 20) / N * 1e9:.0f} ns/sample on one core")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
