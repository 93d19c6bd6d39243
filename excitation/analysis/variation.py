"""What changes in the course of a run: the force from period to period beyond noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import SIGMAS
from excitation.analysis.levels import Level
from excitation.analysis.spectra import LineSpectra

__all__ = ["Trend", "Variation", "variation"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]

_LEAST = 3  # periods: of two, a change and noise look alike


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trend:
    """One run's force over its periods: each as a share of the mean, and the straight line through them."""

    name: str
    gain: Floats  # (P,): Re⟨Y_p, Ȳ⟩/|Ȳ|² on the driven lines
    gain_std: float  # of one, by noise
    mean: Floats  # (P,), N: mean force of each period
    change: float  # of the gain from the first to the last period, by a straight line
    change_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """Rms of the slow change about the mean period and the trend of each run; None where there are too few periods."""

    level: Level | None
    trends: tuple[Trend, ...]


def variation(spectra: Sequence[LineSpectra], driven: Lines) -> Variation:
    """The excess of the variance between periods over that between successive ones, on the driven lines.

    Of white noise both are the same (von Neumann, 1941): their difference is a slow change. Its variance over the lines
    without a change is Var(δ²/2 − s²) = σ⁴·(P − 2)/(2(P − 1)²) of complex normal noise.
    """
    long = [one for one in spectra if one.periods >= _LEAST]
    trends = tuple(_trend(one, driven) for one in long)
    if not long:
        return Variation(level=None, trends=trends)
    power, spread = 0.0, 0.0
    for one in long:
        total, noise = one.total[driven], one.noise[driven]
        power += float(np.sum(total - noise)) / len(long)
        share = 0.5 * (one.periods - 2.0) / (one.periods - 1.0) ** 2
        crossed = 2.0 * np.maximum(total - noise, 0.0) * noise / (one.periods - 1.0)
        spread += float(np.sum(share * noise**2 + crossed)) / len(long) ** 2
    half = SIGMAS * float(np.sqrt(spread))
    return Variation(level=Level(power=power, low=power - half, high=power + half), trends=trends)


def _trend(one: LineSpectra, driven: Lines) -> Trend:
    mean = one.force[driven]
    size = max(float(np.sum(np.abs(mean) ** 2)), float(np.finfo(np.float64).tiny))
    gain = np.real(one.each[:, driven] @ mean.conj()) / size
    std = float(np.sqrt(0.5 * np.sum(np.abs(mean) ** 2 * one.noise[driven]))) / size
    steps = np.arange(one.periods) - 0.5 * (one.periods - 1)
    slope = float(steps @ gain) / float(steps @ steps)
    return Trend(
        name=one.name,
        gain=gain,
        gain_std=std,
        mean=np.real(one.each[:, 0]),
        change=slope * (one.periods - 1),
        change_std=std * (one.periods - 1) / float(np.sqrt(steps @ steps)),
    )
