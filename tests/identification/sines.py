"""Runs of steady sines and triangles through a law of force: for the tests of measures and of the sheet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

Floats = NDArray[np.float64]
Law = Callable[[Floats, Floats], Floats]


def sine_run(law: Law, amplitude: float, frequency: float, *, noise: float = 0.0, periodic: bool = True) -> Run:
    rate, cycles = min(1000.0, 500.0 * frequency), 8
    period = round(rate / frequency)
    t = np.arange(period * cycles) / rate
    turn = 2 * np.pi * t * rate / period
    x = amplitude * np.sin(turn)
    force = law(x, amplitude * 2 * np.pi * rate / period * np.cos(turn))
    rng = np.random.default_rng(round(1e6 * amplitude) + period)
    channels = {
        "displacement": x + 1e-7 * rng.standard_normal(t.size),
        "force": force + noise * rng.standard_normal(t.size),
    }
    return Run(
        run_id=f"{amplitude}-{frequency}", created="2026-01-01T00:00:00+00:00", specimen="s", sample_rate_hz=rate,
        period_samples=period if periodic else 0, excitation_kind="sine", status="complete", channels=channels,
        units={"displacement": "m", "force": "N"}, design=None, events=(), path=None,
    )  # fmt: skip
