"""One period of a signal by its DFT lines: synthesis, exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excitation.portable_math import cosine_and_sine

__all__ = ["Multitone", "Repeated", "derivative"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Multitone:
    """u[n] = Σ A_k cos(2π(k n/N + φ_k)) over the lines k; amplitudes are ≥ 0 in the unit of u, phases in
    turns.
    """

    period_samples: int
    lines: NDArray[np.int64]  # (K,), 0 < k < N/2
    amplitude: NDArray[np.float64]  # (K,)
    phase_turns: NDArray[np.float64]  # (K,)

    def samples(self) -> NDArray[np.float64]:
        """One period, (N,), zero mean."""
        cos, sin = cosine_and_sine(self.phase_turns)
        return self._inverse(self.amplitude * cos, self.amplitude * sin)

    def derivative(self, sample_rate_hz: float) -> NDArray[np.float64]:
        """The exact time derivative of one period, (N,), unit of u per second: each line times jω."""
        cos, sin = cosine_and_sine(self.phase_turns)
        rate = self.amplitude * self.omega(sample_rate_hz)
        return self._inverse(-rate * sin, rate * cos)

    def second_derivative(self, sample_rate_hz: float) -> NDArray[np.float64]:
        """The exact second time derivative of one period, (N,)."""
        omega = self.omega(sample_rate_hz)
        return replace(self, amplitude=self.amplitude * omega * omega).samples() * -1.0

    def omega(self, sample_rate_hz: float) -> NDArray[np.float64]:
        """Angular frequency of each line, (K,), rad/s."""
        return 2.0 * np.pi * sample_rate_hz / self.period_samples * self.lines.astype(np.float64)

    def scaled(self, factor: float) -> Multitone:
        return replace(self, amplitude=self.amplitude * factor)

    def with_phases(self, phase_turns: NDArray[np.float64]) -> Multitone:
        return replace(self, phase_turns=phase_turns)

    def _inverse(self, real: NDArray[np.float64], imaginary: NDArray[np.float64]) -> NDArray[np.float64]:
        spectrum = np.zeros(self.period_samples // 2 + 1, dtype=np.complex128)
        spectrum.real[self.lines] = real
        spectrum.imag[self.lines] = imaginary
        return np.fft.irfft(spectrum, n=self.period_samples, norm="forward") * 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeated:
    """Makes the samples of a multitone about its mean, within the limits, period after period; (periods·N,)."""

    tones: Multitone
    periods: int
    mean: float = 0.0
    least: float = -np.inf
    largest: float = np.inf

    def __call__(self) -> NDArray[np.float64]:
        return np.tile(np.clip(self.mean + self.tones.samples(), self.least, self.largest), self.periods)


def derivative(period: NDArray[np.float64], sample_rate_hz: float) -> NDArray[np.float64]:
    """The time derivative of one period of a band-limited signal, (N,), by its DFT; the Nyquist line is
    dropped.
    """
    spectrum = np.fft.rfft(period)
    omega = 2.0 * np.pi * sample_rate_hz / period.size * np.arange(spectrum.size)
    if period.size % 2 == 0:
        omega[-1] = 0.0
    return np.fft.irfft(1j * omega * spectrum, n=period.size)
