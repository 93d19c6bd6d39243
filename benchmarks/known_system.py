"""A force with known best linear approximation and known odd and even distortion: what an analysis must find.

A random-phase multisine x drives F = H₁·x + c₂·z² + c₃·z³ + noise, z = H_z·x: two first-order filters and a static
polynomial after one of them. With Z_k the complex Fourier coefficient of z on line k (z = Σ over ±k),

    G_BLA(k) = H₁(k) + c₃·H_z(k)·(6·Σ_{a>0}|Z_a|² − 3·|Z_k|²),

the share of z³ whose phase is that of line k whatever the other phases are; the rest of z³ is odd distortion, all of z²
is even distortion (the combinations of lines are those of Pintelon & Schoukens, 2012, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis import Measurement, Realisation
from excitation.lines import Lines, band_lines, excited_lines

__all__ = ["Case", "Known", "played"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SLOPE = {"flat": 0.0, "velocity": -1.0, "road": -1.5}  # displacement amplitude over frequency, as a power


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What is played on which system. The force is about 1 N rms."""

    lines: Lines = "odd-random"
    realisations: int = 1
    periods: int = 4
    shape: str = "flat"
    samples: int = 4096
    sample_rate_hz: float = 512.0
    band_hz: tuple[float, float] = (0.5, 30.0)
    even: float = 0.05  # coefficient of z², of unit rms
    odd: float = 0.02  # coefficient of z³
    noise: float = 0.01  # N rms, white, of one sample


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Known:
    """A measurement and what is true of it."""

    measurement: Measurement
    driven: NDArray[np.int64]
    value: Complex  # (K,): best linear approximation on the driven lines, N/m
    odd: float  # N rms in these realisations, over lines 1 … 5·highest
    even: float
    both: float


def played(case: Case, seed: int) -> Known:
    """Realisations of a case with phases and noise of a seed."""
    rng = np.random.default_rng(seed)
    n, rate = case.samples, case.sample_rate_hz
    driven = excited_lines(band_lines(*case.band_hz, rate, n), case.lines, 4, seed)[0]
    frequency = driven * rate / n
    amplitude = frequency ** _SLOPE[case.shape]
    first, filtered = 0.7 / (1.0 + 1j * frequency / 8.0) + 0.3, 1.0 / (1.0 + 1j * frequency / 12.0)
    amplitude = amplitude / np.sqrt(2.0 * np.sum(np.abs(amplitude * filtered) ** 2))  # z has unit rms
    last = min(5 * int(driven[-1]), (n - 1) // 2)
    runs, odd, even, both = [], 0.0, 0.0, 0.0
    squares = np.abs(amplitude * filtered) ** 2
    systematic = case.odd * filtered * (6.0 * np.sum(squares) - 3.0 * squares)
    for m in range(case.realisations):
        x = amplitude * np.exp(2j * np.pi * rng.random(driven.size))
        z = _samples(x * filtered, driven, n)
        third, second = case.odd * np.fft.rfft(z**3) / n, case.even * np.fft.rfft(z**2) / n
        third[driven] -= systematic * x
        odd += 2.0 * float(np.sum(np.abs(third[1 : last + 1]) ** 2)) / case.realisations
        even += 2.0 * float(np.sum(np.abs(second[1 : last + 1]) ** 2)) / case.realisations
        both += 2.0 * float(np.sum(np.abs((second + third)[1 : last + 1]) ** 2)) / case.realisations
        force = _samples(x * first, driven, n) + case.even * z**2 + case.odd * z**3
        noisy = force + case.noise * rng.standard_normal((case.periods, n))
        moved = np.tile(_samples(x, driven, n), (1, case.periods, 1))
        runs.append(Realisation(name=f"run {m + 1}", inputs=moved, force=noisy))
    measurement = Measurement(sample_rate_hz=rate, inputs=("displacement",), realisations=tuple(runs))
    return Known(
        measurement=measurement,
        driven=driven,
        value=first + systematic,
        odd=float(np.sqrt(odd)),
        even=float(np.sqrt(even)),
        both=float(np.sqrt(both)),
    )


def _samples(coefficients: Complex, lines: NDArray[np.int64], n: int) -> Floats:
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[lines] = coefficients * n
    return np.fft.irfft(spectrum, n=n)
