"""A run of two tones whose force is a law of its motion, its current and its temperature, with noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

Floats = NDArray[np.float64]
Law = Callable[[Floats, Floats, Floats, Floats], Floats]

RATE_HZ, PERIOD, PERIODS = 1000.0, 1000, 4


def inputs(t: Floats) -> tuple[Floats, Floats, Floats]:
    """Displacement, m, velocity, m/s, and current, A, at the times `t`, s: all repeat after a second."""
    turn = 2 * np.pi * t
    x = 0.02 * np.sin(2 * turn) + 0.004 * np.sin(6 * turn + 0.3)
    v = 2 * np.pi * (0.04 * np.cos(2 * turn) + 0.024 * np.cos(6 * turn + 0.3))
    return x, v, 0.9 + 0.5 * np.sin(3 * turn)


def made_run(law: Law, *, noise: float = 0.5, warms_by: float = 0.0) -> Run:
    """A run of four periods; the temperature rises from 25 °C by `warms_by`, K."""
    t = np.arange(PERIOD * PERIODS) / RATE_HZ
    x, v, current = inputs(t)
    temperature = 25.0 + warms_by * t / t[-1]
    rng = np.random.default_rng(1)
    force = law(x, v, current, temperature) + noise * rng.standard_normal(t.size)
    return Run(
        run_id="made", created="2026-01-01T00:00:00+00:00", specimen="specimen", sample_rate_hz=RATE_HZ,
        period_samples=PERIOD, excitation_kind="multisine", status="complete",
        channels={"displacement": x, "force": force, "current": current, "temperature": temperature},
        units={"displacement": "m", "force": "N", "current": "A", "temperature": "degC"}, design=None, events=(),
        path=None,
    )  # fmt: skip
