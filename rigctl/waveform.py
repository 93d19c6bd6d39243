"""What is streamed for one test: the excitation with a ramp before and a ramp after it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation


@dataclass(frozen=True, slots=True, kw_only=True)
class Waveform:
    """Set-points from rest to rest; samples `lead` … `lead + samples` are the excitation as given."""

    displacement_m: NDArray[np.float64]
    current_a: NDArray[np.float64]
    lead: int
    samples: int


def with_ramps(excitation: Excitation, ramp_s: float) -> Waveform:
    """Fade an excitation in from rest at zero and out again, outside the excitation itself.

    Before sample 0 stands the signal's own continuation times (1 − cos πs)/2, s from 0 to 1 over `ramp_s`:
    the periodic extension where there is a period, else the point reflection 2·x[0] − x[−n]. Position and
    velocity have no step.
    """
    x = excitation.displacement_m
    current = np.zeros_like(x) if excitation.current_a is None else excitation.current_a
    n = max(round(ramp_s * excitation.sample_rate_hz), 1)
    fade = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))  # 0 … just below 1
    period = excitation.period_samples
    return Waveform(
        displacement_m=np.concatenate([_before(x, n, period) * fade, x, _after(x, n, period) * fade[::-1]]),
        current_a=np.concatenate([_held(current, -n, period), current, np.full(n, current[-1])]),
        lead=n,
        samples=excitation.samples,
    )


def _before(x: NDArray[np.float64], n: int, period: int) -> NDArray[np.float64]:
    if period:
        return np.take(x, np.arange(-n, 0) % period)
    mirrored: NDArray[np.float64] = 2 * x[0] - np.take(x, np.clip(np.arange(n, 0, -1), 0, x.size - 1))
    return mirrored


def _after(x: NDArray[np.float64], n: int, period: int) -> NDArray[np.float64]:
    if period:
        return np.take(x, (x.size + np.arange(n)) % period)
    mirrored: NDArray[np.float64] = 2 * x[-1] - np.take(x, np.clip(x.size - 2 - np.arange(n), 0, x.size - 1))
    return mirrored


def _held(current: NDArray[np.float64], first: int, period: int) -> NDArray[np.float64]:
    index = np.arange(first, 0) % period if period else np.zeros(-first, dtype=np.intp)
    return np.take(current, index)
