"""Experiment design: coverage, crest factor and time, each with its goal.

`python -c "import benchmarks.bench_excitation as b; b.main(quick=True)"` omits the largest signals.
"""

from __future__ import annotations

import resource
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import to_spec
from excitation.coverage import coverage
from excitation.crest import crest_factor_of, low_crest, schroeder
from excitation.homogenise import homogenised
from excitation.multisine import Period, random_phase
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec

Result = TypeVar("Result")

PAPER = {  # Witters & Swevers 2009: quarter-car displacement, control current, 10 × 10 cells
    "sample_rate": 1000.0,
    "period_samples": 8192,
    "displacement": {
        "f_min": 0.25,
        "f_max": 30.0,
        "spectrum": "quarter-car",
        "max_displacement": 0.06,
        "max_velocity": 1.5,
    },
    "current": {"f_min": 0.25, "f_max": 100.0, "spectrum": "control", "min": 0.3, "max": 1.6},
}
DUYM = HomogeniseSpec(method="duym")
DIRECT = HomogeniseSpec(method="direct")


def main(quick: bool = False) -> None:
    """Prints measured against goal."""
    spec = to_spec(MultisineSpec, PAPER)
    homogenised(replace(spec, homogenise=replace(DIRECT, iterations=1)))  # compiled, or loaded from the cache
    seeds(spec)
    spectrum_kept(spec)
    crest()
    sizes(spec, range(13, 17) if quick else range(13, 21))


def seeds(spec: MultisineSpec, count: int = 50) -> None:
    """Coverage index and time over seeds at N = 8 192."""
    print(f"N = 8 192, quarter car, velocity × current over 10 × 10 cells, {count} seeds")
    methods: list[tuple[str, HomogeniseSpec | None, float | None, float | None]] = [
        ("random", None, None, None),
        ("duym", DUYM, 5.6, None),
        ("direct", DIRECT, 0.5, 1.0),
    ]
    for name, how, goal, limit_s in methods:
        index, seconds, speed = [], [], []
        for seed in range(count):
            asked = replace(spec, seed=seed, homogenise=how)
            period, elapsed = _timed(lambda a=asked: _made(a))
            index.append(_index(asked, period))
            seconds.append(elapsed)
            speed.append(float(np.abs(period.velocity_m_s).max()))
        _row(f"  {name}: D, worst seed", max(index), "%", goal)
        print(f"  {name}: D, median seed {statistics.median(index):.3g} %, best {min(index):.3g} %")
        _row(f"  {name}: time, median", statistics.median(seconds), "s", limit_s)
        print(f"  {name}: peak velocity within ±6 cm, median {statistics.median(speed):.3f} m/s of 1.5")


def spectrum_kept(spec: MultisineSpec) -> None:
    """Largest relative change of a line's share of the spectrum between random-phase and homogenised
    design.
    """
    before, after = random_phase(spec), homogenised(replace(spec, homogenise=DIRECT))
    worst = max(
        _shape_change(before.displacement_m, after.displacement_m, before.displacement.lines),
        _shape_change(_current(before), _current(after), before.current.lines if before.current else None),
    )
    _row("spectrum shape, largest relative change of a line", worst, "", 1e-9)


def _shape_change(a: NDArray[np.float64], b: NDArray[np.float64], lines: NDArray[np.int64] | None) -> float:
    one, other = (np.abs(np.fft.rfft(u))[lines] for u in (a, b))
    return float(np.abs(one / one.sum() / (other / other.sum()) - 1.0).max())


def crest() -> None:
    """Crest factors of flat spectra, compared with Schroeder's phases."""
    for count in (15, 31, 100):
        lines, flat = np.arange(1, count + 1), np.ones(count)
        start = crest_factor_of(lines, flat, schroeder(flat))
        phases, elapsed = _timed(lambda k=lines, a=flat: low_crest(k, a, goal=1.41))
        _row(
            f"crest factor, {count} flat lines (Schroeder {start:.3f})", crest_factor_of(lines, flat, phases), "", 1.41
        )
        _row("  time", elapsed, "s", 2.0)


def sizes(spec: MultisineSpec, powers: range) -> None:
    """Time of each method from 2^13 to 2^20 samples, and the memory at its peak."""
    for power in powers:
        sized = replace(spec, period_samples=2**power, seed=1000)  # not computed before, so not cached
        _, random_s = _timed(lambda s=sized: random_phase(s))
        _, duym_s = _timed(lambda s=sized: homogenised(replace(s, homogenise=replace(DUYM, iterations=20))))
        asked = replace(sized, homogenise=DIRECT)
        period, direct_s = _timed(lambda s=asked: homogenised(s))
        motion = period.displacement
        _, crest_s = _timed(lambda m=motion: low_crest(m.lines, m.amplitude, starts=1))
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 2**20)
        print(
            f"N = 2^{power}: random {random_s:.3f} s, Duym, 20 rounds {duym_s:.2f} s, direct {direct_s:.2f} "
            "s "
            f"(D = {_index(asked, period):.3g} %), crest {crest_s:.2f} s; peak memory {peak_mb:.0f} MB",
            flush=True,
        )
        if power == 20:
            _row("N = 2^20, direct", direct_s, "s", 60.0)


def _made(spec: MultisineSpec) -> Period:
    return random_phase(spec) if spec.homogenise is None else homogenised(spec)


def _index(spec: MultisineSpec, period: Period) -> float:
    return coverage([period.variable(name) for name in spec.covered_variables], (10, 10)).index


def _current(period: Period) -> NDArray[np.float64]:
    assert period.current_a is not None
    return period.current_a


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def _row(what: str, measured: float, unit: str, goal: float | None) -> None:
    verdict = "" if goal is None else f"   goal ≤ {goal:g} {unit}: {'met' if measured <= goal else 'MISSED'}"
    print(f"{what}: {measured:.4g} {unit}{verdict}", flush=True)


if __name__ == "__main__":
    main()
