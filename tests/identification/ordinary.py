"""Runs of ordinary dampers without periods, as a recorder has them: laws of their own, two sines or a road."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

Floats = NDArray[np.float64]
RATE = 250.0


def digressive(v: Floats, compression: float = 1.0) -> Floats:
    """A valve that bends at 0.1 m/s, and in compression gives another share of its force."""
    force = 2200.0 * v / (1.0 + np.abs(v / 0.1) ** 1.3) ** (0.75 / 1.3)
    return np.asarray(np.where(v > 0.0, force, compression * force))


def motion(seed: int, amplitude: float, seconds: float = 12.0) -> tuple[Floats, Floats, Floats]:
    """Time, displacement and velocity of two sines that share no period, (N,) each."""
    rng = np.random.default_rng([5, seed])
    t = np.arange(round(seconds * RATE)) / RATE
    x, v = np.zeros(t.size), np.zeros(t.size)
    for share, hz in ((0.7, 0.8 + rng.uniform(0.0, 0.4)), (0.3, 3.0 + rng.uniform(0.0, 1.5))):
        turn = 2.0 * np.pi * hz * t + rng.uniform(0.0, 2.0 * np.pi)
        x, v = x + amplitude * share * np.sin(turn), v + amplitude * share * 2.0 * np.pi * hz * np.cos(turn)
    return t, x, v


def recorded(
    name: str,
    seed: int,
    x: Floats,
    force: Floats,
    noise: float = 2.0,
    more: Mapping[str, Floats] | None = None,
    rate: float = RATE,
) -> Run:
    """The run of a displacement and a force with their noise, and further channels as they are."""
    rng = np.random.default_rng([6, seed])
    channels = {
        "displacement": x + 2e-6 * rng.standard_normal(x.size),
        "force": force + noise * rng.standard_normal(x.size),
        **(more or {}),
    }
    units = {"displacement": "m", "force": "N", "current": "A", "temperature": "degC"}
    return Run(
        run_id=f"{name}-{seed}", created="2026-01-01T00:00:00+00:00", specimen=name, sample_rate_hz=rate,
        period_samples=0, excitation_kind="custom", status="complete", channels=channels,
        units={c: units[c] for c in channels}, design=None, events=(), path=None,
    )  # fmt: skip


def campaign(name: str, law: Callable[[Floats, Floats], Floats], amplitudes: tuple[float, ...]) -> list[Run]:
    """One run for each amplitude of a force over displacement and velocity."""
    runs = []
    for k, amplitude in enumerate(amplitudes):
        _, x, v = motion(k, amplitude)
        runs.append(recorded(name, k, x, law(x, v)))
    return runs
