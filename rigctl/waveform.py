"""The set-points that are streamed for one test: excitation, or its rest, between two ramps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.signal import Excitation


@dataclass(frozen=True, slots=True, kw_only=True)
class Waveform:
    """Set-points from rest to rest; samples `lead` … `lead + samples` are the excitation from `start` on."""

    displacement_m: NDArray[np.float64]
    current_a: NDArray[np.float64]
    lead: int
    samples: int
    start: int


def with_ramps(excitation: Excitation, ramp_s: float, *, start: int = 0, settle_s: float = 0.0) -> Waveform:
    """Excitation from sample `start`, with a fade-in from rest at zero before it and a fade-out after it.

    Before sample `start` the preceding samples are played, times (1 − cos πs)/2, s from 0 to 1 over `ramp_s`: the
    excitation itself, and before its beginning the periodic extension where there is a period, else the point
    reflection 2·x[0] − x[−n]. Position and velocity have no step. A periodic excitation is played at full
    amplitude for another `settle_s` before recording.
    """
    x, period = excitation.displacement_m, excitation.period_samples
    current = np.zeros_like(x) if excitation.current_a is None else excitation.current_a
    n = max(round(ramp_s * excitation.sample_rate_hz), 1)
    settle = round(settle_s * excitation.sample_rate_hz) if period else 0
    fade = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))  # 0 … just below 1
    before = np.arange(start - n - settle, start)
    return Waveform(
        displacement_m=np.concatenate(
            [
                _extended(x, before, period) * np.append(fade, np.ones(settle)),
                x[start:],
                _after(x, n, period) * fade[::-1],
            ]
        ),
        current_a=np.concatenate([_held(current, before, period), current[start:], np.full(n, current[-1])]),
        lead=n + settle,
        samples=excitation.samples - start,
        start=start,
    )


def _extended(x: NDArray[np.float64], index: NDArray[np.intp], period: int) -> NDArray[np.float64]:
    if period:
        return np.take(x, np.where(index < 0, index % period, index))
    mirrored = 2 * x[0] - np.take(x, np.clip(-index, 0, x.size - 1))
    return np.where(index < 0, mirrored, np.take(x, np.maximum(index, 0)))


def _after(x: NDArray[np.float64], n: int, period: int) -> NDArray[np.float64]:
    if period:
        return np.take(x, (x.size + np.arange(n)) % period)
    mirrored: NDArray[np.float64] = 2 * x[-1] - np.take(x, np.clip(x.size - 2 - np.arange(n), 0, x.size - 1))
    return mirrored


def _held(current: NDArray[np.float64], index: NDArray[np.intp], period: int) -> NDArray[np.float64]:
    return np.take(current, np.where(index < 0, index % period if period else 0, index))
