"""Crest factors: flat and log-spaced lines, one quantity as a configuration asks for it, all limits together.

`python -m benchmarks.bench_crest`: about two minutes.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.bench_coverage import PAPER
from excitation.configuration import to_spec
from excitation.crest import crest_factor_of
from excitation.joint_crest import Limited, low_shares
from excitation.multisine import random_phase
from excitation.multisine_spec import MultisineSpec


def main() -> None:
    """Prints measured against goal."""
    for count in (31, 100, 1000):
        _row(f"{count} flat lines", np.arange(1, count + 1), 1.38)
    for decades, goal in ((2.0, 2.1), (2.5, 2.1), (3.0, None)):
        _row(f"35 log-spaced lines over {decades:g} decades", log_spaced(35, decades), goal)
    chosen()
    together(to_spec(MultisineSpec, PAPER))


def log_spaced(count: int, decades: float) -> NDArray[np.int64]:
    """So many different lines from 1 to 10^decades."""
    for points in range(count, 100 * count):
        lines = np.unique(np.round(np.logspace(0.0, decades, points)).astype(np.int64))
        if lines.size == count:
            return lines
    raise ValueError(f"no {count} lines over {decades:g} decades")


def chosen() -> None:
    """The displacement alone kept flat, as a configuration asks for it: flat lines, and 35 spaced by their logarithm
    from the first, third or tenth DFT line over two decades: the peak grows with the number of the highest line. With
    odd lines only, the second half of the period is the first with the opposite sign: half as many peaks."""
    for count in (31, 100, 1000):
        _designed(f'crest_of = "displacement", {count} flat lines', 2**14, 1, count, "all", 1.38)
    for lowest, goal in ((1, 2.1), (3, 2.1), (10, 2.1), (20, None)):
        text = f'crest_of = "displacement", 35 log-spaced lines from line {lowest} to {100 * lowest}'
        _designed(text, 2**15, lowest, 100 * lowest, {"count": 35}, goal)
    nearest = {"count": 35, "odd": False}
    _designed('crest_of = "displacement", the nearest 35 of lines 10 to 1000', 2**15, 10, 1000, nearest, None)


def _designed(what: str, samples: int, low: int, high: int, lines: object, goal: float | None) -> None:
    spacing, worked = 1000.0 / samples, time.process_time()
    motion = {"f_min": low * spacing, "f_max": (high + 0.2) * spacing, "lines": lines, "spectrum": "flat",
              "max_displacement": 0.02, "max_velocity": 50.0}  # fmt: skip
    asked = {"sample_rate": 1000.0, "period_samples": samples, "phases": "crest", "crest_of": "displacement"}
    made = random_phase(to_spec(MultisineSpec, {**asked, "displacement": motion})).displacement
    crest, worked = crest_factor_of(made.lines, made.amplitude, made.phase_turns), time.process_time() - worked
    verdict = "" if goal is None else f"   goal ≤ {goal:g}: {'met' if crest <= goal else 'MISSED'}"
    print(f"{what} ({made.lines.size}): crest factor {crest:.4f}, {worked:.1f} s of processor{verdict}", flush=True)


def together(spec: MultisineSpec) -> None:
    """The speed reached within ±60 mm and 1.5 m/s, and with 60 m/s² too."""
    for spectrum, limit in (("quarter-car", None), ("road", 60.0)):
        for what in ("limits", "displacement", "velocity", "acceleration"):
            motion = replace(spec.displacement, spectrum=spectrum, max_acceleration_m_s2=limit)
            asked = replace(spec, displacement=motion, phases="crest", crest_of=what)  # type: ignore[arg-type]
            period = random_phase(asked)
            used = ", ".join(f"{one.name} {one.used:.2f}" for one in period.limits)
            rms = float(np.sqrt(np.mean(period.velocity_m_s**2)))
            print(f"{spectrum}, crest_of {what}: {rms:.3f} m/s rms; share of limits: {used}", flush=True)


def _row(what: str, lines: NDArray[np.int64], goal: float | None) -> None:
    flat, start = np.ones(lines.size), time.perf_counter()
    limited = Limited(amplitude=flat, turns=np.zeros(lines.size), limit=float(np.sqrt(0.5 * lines.size)))
    crest = crest_factor_of(lines, flat, low_shares(lines, [limited], goal=1.375))
    verdict = "" if goal is None else f"   goal ≤ {goal:g}: {'met' if crest <= goal else 'MISSED'}"
    print(f"{what}: crest factor {crest:.4f}, {time.perf_counter() - start:.1f} s{verdict}", flush=True)


if __name__ == "__main__":
    main()
