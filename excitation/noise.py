"""Noise of a given power density: displacement, velocity or acceleration, periodic and band-limited."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.bounds import Bounds
from excitation.checks import check_above, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.kinds import NOISE, Kind
from excitation.lines import band_lines
from excitation.periodic import Multitone
from excitation.portable_math import uniform
from excitation.signal import Excitation
from excitation.spectra import check_table
from excitation.tone_drive import tone_drive

__all__ = ["Density", "NoiseSpec", "noise"]

_MOST_SAMPLES = 2**24


@dataclass(frozen=True, slots=True, kw_only=True)
class Density:
    """One-sided power density at given frequencies, straight between them where both axes are logarithmic.

    Unit²/Hz, the unit that of ``of``: m, m/s or m/s².
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    frequency_hz: tuple[float, ...]
    density: tuple[float, ...]
    of: Literal["displacement", "velocity", "acceleration"] = "displacement"

    def __post_init__(self) -> None:
        check_table(self.frequency_hz, self.density, "density")
        if self.frequency_hz[0] <= 0 or min(self.density) <= 0:
            raise DesignError("density: frequencies and densities must be above 0: both axes are logarithmic")


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseSpec:
    """Every DFT line of the density's band, with random phases and, where asked, random amplitudes.

    ``amplitudes`` "random": those of Gaussian noise (Rayleigh distributed); "fixed": the density is met on each line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    period_samples: int
    density: Density
    bounds: Bounds
    periods: int = 1
    seed: int = 0
    realisation: int = 0
    amplitudes: Literal["random", "fixed"] = "random"
    level: float = 1.0
    current_a: float | None = None

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        check_within("period_samples", self.period_samples, 8, _MOST_SAMPLES)
        check_within("periods", self.periods, 1, max(1, _MOST_SAMPLES // self.period_samples))
        check_within("seed", self.seed, 0, 2**63 - 1)
        check_within("realisation", self.realisation, 0, 2**63 - 1)
        check_within("level", self.level, 1e-6, 1e3)
        if self.density.frequency_hz[-1] >= self.sample_rate_hz / 2:
            raise DesignError(
                f"density.frequency reaches {self.density.frequency_hz[-1]:g} Hz: it must stay below half the sample "
                f"rate ({self.sample_rate_hz / 2:g} Hz)"
            )


def noise(spec: NoiseSpec) -> Excitation:
    """Periodic noise whose displacement, velocity or acceleration has the density that is asked for.

    x(t) = Σ sqrt(2·S(f_k)·Δf)·r_k·cos(2π(f_k·t + φ_k)), Δf = sample_rate/period_samples; r_k = sqrt(−ln u_k), whose
    mean square is 1, or 1; S that of the displacement, S_v/(2πf)² or S_a/(2πf)⁴.

    Raises DesignError where the band holds no line, or the noise exceeds its bounds.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: periodic noise.
    """
    known = spec.density
    lines = band_lines(known.frequency_hz[0], known.frequency_hz[-1], spec.sample_rate_hz, spec.period_samples)
    spacing_hz = spec.sample_rate_hz / spec.period_samples
    frequency_hz = lines.astype(np.float64) * spacing_hz
    amplitude = np.sqrt(2.0 * _displacement_density(known, frequency_hz) * spacing_hz)
    if spec.amplitudes == "random":
        amplitude = amplitude * np.sqrt(-np.log(1.0 - uniform((spec.seed, spec.realisation, 11), lines.size)))
    tones = Multitone(
        period_samples=spec.period_samples,
        lines=lines,
        amplitude=amplitude,
        phase_turns=uniform((spec.seed, spec.realisation, 10), lines.size),
    )
    return tone_drive(
        tones,
        sample_rate_hz=spec.sample_rate_hz,
        periods=spec.periods,
        bounds=spec.bounds,
        level=spec.level,
        current_a=spec.current_a,
        kind=Kind.MULTISINE,
        design={"kind": NOISE, **to_config(spec)},
    )


def _displacement_density(known: Density, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """m²/Hz at each frequency, (K,)."""
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[known.of]
    density = np.exp(np.interp(np.log(frequency_hz), np.log(known.frequency_hz), np.log(known.density)))
    return np.asarray(density / (2.0 * np.pi * frequency_hz) ** (2 * order))
