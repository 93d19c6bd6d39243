"""Runs of a rig of six axes for tests: of a specimen that is a formula, so that the right answers are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identification.multiaxis import LOADS, MOTIONS
from rigctl.further_axes import FURTHER_AXES
from rigctl.runfile import Run

Floats = NDArray[np.float64]
RATE_HZ, SAMPLES = 100.0, 1500
LARGEST = np.array([4e-3, 4e-3, 4e-3, 0.02, 0.03, 0.03])
# A specimen that is a formula, so that the right choice is known.
FORMULA: tuple[Callable[[Floats, Floats], Floats], ...] = (
    lambda d, v: 3e4 * v[:, 0] + 4e7 * d[:, 1] ** 2,
    lambda d, v: 2e5 * d[:, 1],
    lambda d, v: 2e5 * d[:, 2] + 100.0 * v[:, 2],
    lambda d, v: 300.0 * d[:, 3],
    lambda d, v: 400.0 * d[:, 4] + 5e3 * d[:, 2],
    lambda d, v: 400.0 * d[:, 5],
)


def motion(seed: int, factor: float = 1.0) -> Floats:
    rng, t = np.random.default_rng([6, seed]), np.arange(SAMPLES) / RATE_HZ
    axes = []
    for k, size in enumerate(LARGEST):
        hertz = rng.uniform(0.3, 4.0, 20)
        course = np.sin(np.multiply.outer(t, 2.0 * np.pi * hertz) + rng.uniform(0.0, 6.3, 20)) @ hertz**-0.5
        axes.append((factor if k in (1, 2) else 1.0) * size * course / np.max(np.abs(course)) * np.minimum(1.0, t))
    return np.column_stack(axes)


def run_of(moved: Floats, loads: Floats, name: str) -> Run:
    names = (*MOTIONS, *LOADS)
    return Run(
        run_id=name, created="2026-01-01T00:00:00+00:00", specimen="six axes", sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete",
        channels=dict(zip(names, [*moved.T.copy(), *loads.T.copy()], strict=True)),
        units={"displacement": "m", "force": "N", **FURTHER_AXES},
    )  # fmt: skip


def by_formula(moved: Floats, name: str) -> Run:
    speed = np.gradient(moved, axis=0) * RATE_HZ
    return run_of(moved, np.column_stack([one(moved, speed) for one in FORMULA]), name)


def singles_of(moved: Floats, made: Callable[[Floats, str], Run]) -> list[Run]:
    return [made(moved * (np.arange(6) == k), f"axis-{k}") for k in range(6)]
