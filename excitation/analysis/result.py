"""What an analysis finds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.levels import Level
from excitation.analysis.seen_lines import SeenLines
from excitation.analysis.variation import Variation

__all__ = ["Analysis", "Levels", "LineLevels", "Played", "Response"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """One realisation as it was used."""

    name: str
    periods: int  # used
    left_out: int  # leading periods that had not settled
    also: tuple[str, ...] = ()  # further runs of the same realisation, whose periods are among these


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Response:
    """The best linear approximation of the force over one quantity on the lines that excite it, (K,) each."""

    over: str  # "displacement", "velocity", "current"
    unit: str  # of the value
    lines: NDArray[np.int64]
    frequency_hz: Floats
    value: Complex
    std: Floats  # √E|ΔG|²: stochastic distortion and noise; NaN where neither realisations nor lines tell
    bound: Floats  # radius about the value that holds it with the probability CONFIDENCE; NaN as std
    noise_std: Floats  # by noise alone; NaN where there is one period


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineLevels:
    """Rms of one kind of force on lines, N; smooth: over neighbouring lines."""

    kind: str  # "odd", "even", "odd and even", "noise", "force"
    lines: NDArray[np.int64]
    frequency_hz: Floats
    rms: Floats
    smooth: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Parts of the force, each rms over the lines up to ``REACH`` times the band, without its mean. None: not known.

    Odd, even and their sum are those of the runs that were given. The noise is that of one period.
    """

    force_rms: float  # N, all of it in one period
    linear_rms: float  # N, of the linear approximation
    odd: Level | None
    even: Level | None
    nonlinear: Level | None  # odd and even together
    noise: Level | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Analysis:
    """Best linear approximation, distortion, noise and time variation of periodic tests."""

    sample_rate_hz: float
    samples: int  # of a period
    played: tuple[Played, ...]
    method: str  # how distortion was told from noise, in words
    lines: SeenLines
    responses: tuple[Response, ...]
    frequency_hz: Floats  # (K,) of the driven lines
    coherence: Floats  # (K,): linear share of the force on each driven line; NaN where the rest is not known
    noise_coherence: Floats  # (K,): the same with the noise as the only rest
    levels: Levels
    spectrum: tuple[LineLevels, ...]
    variation: Variation
    notes: tuple[str, ...]

    @property
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest driven frequency."""
        low, high = self.lines.band
        return low * self.sample_rate_hz / self.samples, high * self.sample_rate_hz / self.samples

    @property
    def reach_hz(self) -> float:
        """The highest frequency that the levels count."""
        seen = (self.lines.driven, self.lines.odd, self.lines.even, self.lines.mixed)
        return max(int(lines[-1]) for lines in seen if lines.size) * self.sample_rate_hz / self.samples
