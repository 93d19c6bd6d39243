"""Tare, crawl, weighing and force-controlled zero over many random simulated specimens, on a clock that does not wait.

For each: the largest and the rms error, and how often the true value lies within two stated standard uncertainties;
95 % are expected. ``python -m benchmarks.bench_laboratory 10`` tries ten specimens each.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from excitation.plan import Test
from rigctl.player import PlayerSettings, play
from rigctl.procedures.crawl import CrawlSettings, crawl_of, crawl_test
from rigctl.procedures.mounting import mount
from rigctl.procedures.station import commanded
from rigctl.procedures.tare import tare
from rigctl.procedures.weigh import WeighSettings, mass_of, weigh_test
from rigctl.runfile import Run, read_run
from sim_rig import damper
from sim_rig.direct import DirectTransport
from sim_rig.parameters import HYPERBOLIC, Damper
from sim_rig.plant import SimulatedPlant
from sim_rig.rig import SimulatedRig
from sim_rig.sensors import Noise

NOTHING = Damper(base=HYPERBOLIC, heat_capacity=1e9, scale_m=0.03)
START_DEGC = 22.0
Errors = dict[str, list[tuple[float, float]]]  # quantity: error and standard uncertainty of each specimen


class SteppedClock:
    """Time that passes only when somebody sleeps."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += max(seconds, 0.0)


class Yes:
    """An operator who confirms everything."""

    def confirm(self, text: str) -> None:
        pass

    def number(self, text: str, unit: str) -> float:
        raise ValueError(text)


def a_rig(specimen: Damper, seed: int, noise_n: float) -> tuple[DirectTransport, SteppedClock]:
    clock = SteppedClock()
    plant = SimulatedPlant(specimen, Noise(force_n=noise_n), seed=seed, start_degc=START_DEGC)
    return DirectTransport(SimulatedRig(plant, speed=20.0, now=clock.now), clock), clock


def played(specimen: Damper, seed: int, noise_n: float, test: Test) -> Run:
    wire, clock = a_rig(specimen, seed, noise_n)
    with tempfile.TemporaryDirectory() as folder, closing(wire):
        return read_run(play(wire, test, Path(folder), clock=clock, settings=PlayerSettings(ramp_s=0.5)))


def tares(seed: int, errors: Errors) -> None:
    random = np.random.default_rng([1, seed])
    offset = random.uniform(-600, 600)
    wire, clock = a_rig(NOTHING._replace(offset=offset), seed, 10.0)
    with commanded(wire, clock) as station:
        found = tare(station.axis, clock, station.identity)
    errors.setdefault("tare, N", []).append((found.offset_n - offset, found.uncertainty_n))


def crawls(seed: int, errors: Errors) -> None:
    random = np.random.default_rng([2, seed])
    specimen = NOTHING._replace(
        stiffness=random.uniform(0, 20e3),
        preload=random.uniform(-500, 0),
        gas=random.uniform(50, 400),
        gas_length=random.uniform(0.1, 0.3),
        coulomb=random.uniform(5, 150),
        c=random.uniform(200, 3000),
    )
    found = crawl_of(
        played(specimen, seed, random.uniform(2, 15), crawl_test(CrawlSettings(amplitude_m=0.005, cycles=1)))
    )
    force = [damper.springs(specimen, x, START_DEGC) for x in (-1e-6, 0.0, 1e-6)]
    friction = damper.friction(specimen, found.speed_m_s) + specimen.c * found.speed_m_s
    true = (force[1], (force[2] - force[0]) / 2e-6, friction)
    names = ("gas force, N", "spring rate, N/m", "friction, N")
    for name, one, value in zip(names, (found.gas_n, found.spring_n_m, found.friction_n), true, strict=True):
        errors.setdefault(name, []).append((one.value - value, one.uncertainty))


def masses(seed: int, errors: Errors) -> None:
    random = np.random.default_rng([3, seed])
    kilograms = random.uniform(0, 8)
    specimen = NOTHING._replace(mass=kilograms, offset=random.uniform(-100, 100))
    found = mass_of(played(specimen, seed, random.uniform(2, 15), weigh_test(WeighSettings(seed=seed))))
    errors.setdefault("mass, kg", []).append((found.mass_kg - kilograms, found.uncertainty_kg))


def zeros(seed: int, errors: Errors) -> None:
    random = np.random.default_rng([4, seed])
    stiffness = 10 ** random.uniform(4.3, 5.3)
    preload = random.uniform(-1, 1) * min(stiffness * 0.008, 900.0)
    wire, clock = a_rig(NOTHING._replace(stiffness=stiffness, preload=preload, c=2000.0, coulomb=40.0), seed, 10.0)
    here = mount(wire, clock, Yes()).zero
    left = stiffness * here.displacement_m + preload
    errors.setdefault("force left by the force-controlled zero, N", []).append((left, 20.0 / 2 + here.uncertainty_n))


def main(count: int = 40) -> None:
    """Raises SystemExit where a share lies below what 95 % allow in so many (binomial, 1 in 1000)."""
    steps: tuple[tuple[Callable[[int, Errors], None], int], ...] = (
        (tares, round(2.5 * count)), (crawls, count), (masses, count), (zeros, count),
    )  # fmt: skip
    short = False
    for step, many in steps:
        errors: Errors = {}
        for seed in range(many):
            step(seed, errors)
        for name, rows in errors.items():
            short = not told(name, np.array(rows)) or short
    if short:
        raise SystemExit("stated uncertainties are too small")


def told(name: str, rows: NDArray[np.float64]) -> bool:
    """Print one line; False where fewer are within two standard uncertainties than 95 % allow."""
    error, uncertainty = rows.T
    within = int(np.sum(np.abs(error) <= 2 * uncertainty))
    print(
        f"  {name:45s} rms {np.sqrt(np.mean(error**2)):8.3g}  largest {np.max(np.abs(error)):8.3g}  "
        f"stated {np.sqrt(np.mean(uncertainty**2)):8.3g}  within 2 u: {within} of {error.size}",
        flush=True,
    )
    return bool(within >= 0.95 * error.size - 3.1 * np.sqrt(0.95 * 0.05 * error.size))


if __name__ == "__main__":
    main(*(int(text) for text in sys.argv[1:2]))
