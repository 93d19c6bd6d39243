"""A damper with memory for the tests of black boxes, and runs of it: friction that bends before it slides, and oil."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigctl.runfile import Run

Floats = NDArray[np.float64]

RATE_HZ = 200.0
_FINE = 10


def hysteretic(
    seed: int,
    samples: int,
    *,
    rate_hz: float = RATE_HZ,
    noise: float = 0.01,
    current: bool = False,
    held_a: float | None = None,
    rest_s: float = 0.0,
) -> Run:
    """A run of a multisine of 0.4 to 6 Hz that rests at both ends; its force has `noise` times its size of noise.

    Its current is not recorded and 0.5 A, or recorded: with `current` a sine, with `held_a` that value, A.
    """
    rng = np.random.default_rng(seed)
    count, dt = samples * _FINE, 1.0 / (rate_hz * _FINE)
    t = np.arange(count) * dt
    tones = 2.0 * np.pi * rng.uniform(0.4, 6.0, 24)
    turns = np.multiply.outer(t, tones) + rng.uniform(0.0, 2.0 * np.pi, tones.size)
    x = np.sin(turns) @ (0.004 / tones * 10.0)
    v = np.cos(turns) @ np.full(tones.size, 0.04)
    if rest_s:  # it starts and stops within half a second
        share = np.clip(2.0 * (np.minimum(t, t[-1] - t) - rest_s), 0.0, 1.0)
        x = x * share
        v = np.gradient(x, dt)
    i = (
        0.5 + 0.4 * np.sin(2.0 * np.pi * 0.7 * t + rng.uniform(0.0, 6.0))
        if current
        else np.full(count, 0.5 if held_a is None else held_a)
    )
    force = _force(v, i, dt)[::_FINE]
    channels = {
        "displacement": x[::_FINE] + 1e-6 * rng.standard_normal(samples),
        "force": force + noise * np.std(force) * rng.standard_normal(samples),
    }
    units = {"displacement": "m", "force": "N"}
    if current or held_a is not None:
        channels["current"], units["current"] = i[::_FINE].copy(), "A"
    return Run(
        run_id=f"hysteretic-{seed}", created="2026-01-01T00:00:00+00:00", specimen="hysteretic",
        sample_rate_hz=rate_hz, period_samples=0, excitation_kind="custom", status="complete",
        channels=channels, units=units,
    )  # fmt: skip


def _force(v: Floats, i: Floats, dt: float) -> Floats:
    """Oil 400·v/(1 + |v|/0.6) and a friction of (60 + 80·i) N that builds up over some tenths of a millimetre."""
    force, bent = np.empty(v.size), 0.0
    for k in range(v.size):
        bent += dt * 4000.0 * v[k] * (1.0 - np.sign(v[k]) * bent)
        force[k] = 400.0 * v[k] / (1.0 + abs(v[k]) / 0.6) + (60.0 + 80.0 * i[k]) * bent
    return force
