"""Grounds that move a vehicle: a sine, a multisine of known lines, a road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from excitation import RoadProfileSpec
from excitation import ride as road_ride
from excitation.periodic import Multitone, derivative
from identification.errors import DataError
from identification.studies.vehicle.protocol import Ground

Floats = NDArray[np.float64]

_RISE_S = 1.0  # of every ground: the vehicle begins at rest, and a ground that jumps would strike it


def sine(frequency_hz: float, amplitude_m: float, seconds: float, dt: float) -> Ground:
    """A sine whose amplitude rises over the first second."""
    if not 0.0 < frequency_hz < 0.25 / dt:
        raise DataError(f"frequency is {frequency_hz:g} Hz: it must lie within (0, {0.25 / dt:g}) at this step")
    _check_positive("amplitude", amplitude_m, "m")
    w, t = 2.0 * np.pi * frequency_hz, np.arange(round(seconds / dt)) * dt
    x = amplitude_m * np.sin(w * t)
    return risen(Ground(dt=dt, x=x[:, None], v=(w * amplitude_m * np.cos(w * t))[:, None], a=(-w * w * x)[:, None]))


def tones(low_hz: float, high_hz: float, rms_m: float, period_s: float, dt: float, seed: int) -> Multitone:
    """A random-phase multisine on all lines from `low_hz` to `high_hz`, flat in velocity as roads are; rms in m."""
    samples = round(period_s / dt)
    first, last = max(1, round(low_hz * period_s)), round(high_hz * period_s)
    if not (first < last and 4 * last < samples):
        raise DataError(
            f"multisine from {low_hz:g} to {high_hz:g} Hz on a period of {period_s:g} s at a step of {dt:g} s: "
            "it needs at least two lines, and four samples to the fastest"
        )
    _check_positive("rms", rms_m, "m")
    lines = np.arange(first, last + 1, dtype=np.int64)
    amplitude = 1.0 / lines
    amplitude *= rms_m / np.sqrt(0.5 * np.sum(amplitude**2))
    phase = np.random.default_rng(seed).uniform(0.0, 1.0, lines.size)
    return Multitone(period_samples=samples, lines=lines, amplitude=amplitude, phase_turns=phase)


def multisine(multitone: Multitone, periods: int, dt: float) -> Ground:
    """Some periods of a multisine."""
    one = (multitone.samples(), multitone.derivative(1.0 / dt), multitone.second_derivative(1.0 / dt))
    x, v, a = (np.tile(series, periods)[:, None] for series in one)
    return risen(Ground(dt=dt, x=x, v=v, a=a))


def road(spec: RoadProfileSpec, speed_m_s: float, dt: float) -> Ground:
    """A road of ISO 8608 at a constant speed, from its beginning to its end, about its height at the beginning."""
    met = road_ride(spec, speed_m_s, 1.0 / dt)
    acceleration = (
        derivative(met.velocity_m_s, met.sample_rate_hz) if spec.periodic else np.gradient(met.velocity_m_s, dt)
    )
    x = met.height_m - met.height_m[0]
    return risen(Ground(dt=dt, x=x[:, None], v=met.velocity_m_s[:, None], a=acceleration[:, None]))


def delayed(ground: Ground, delays_s: Sequence[float]) -> Ground:
    """The first column met again after each delay, as axle after axle meets a road: (N, G)."""
    shifts = [round(delay / ground.dt) for delay in delays_s]

    def met(series: Floats) -> Floats:
        return np.column_stack([np.concatenate([np.zeros(k), series[: series.shape[0] - k, 0]]) for k in shifts])

    return replace(ground, x=met(ground.x), v=met(ground.v), a=met(ground.a))


def risen(ground: Ground) -> Ground:
    """The ground faded in over its first second: s(t)·x(t), with the derivatives of that."""
    q = np.clip(ground.time / _RISE_S, 0.0, 1.0)[:, None]
    s, ds, dds = q**3 * (10 - 15 * q + 6 * q**2), 30 * q**2 * (1 - q) ** 2, 60 * q * (1 - q) * (1 - 2 * q)
    ds, dds = ds / _RISE_S, dds / _RISE_S**2
    return replace(
        ground,
        x=s * ground.x,
        v=s * ground.v + ds * ground.x,
        a=s * ground.a + 2.0 * ds * ground.v + dds * ground.x,
    )


def _check_positive(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise DataError(f"{name} is {value:g} {unit}: it must be above 0")
