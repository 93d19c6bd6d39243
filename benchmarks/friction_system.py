"""A damper with dry friction on a rig whose displacement is measured with noise: distortion of every order.

A random-phase multisine x moves F = k·x + c·v + F_c·tanh(v/v_t) + k₂·x² + c₂·|v|: the friction is odd, the gas spring
and the difference between rebound and compression are even. What is measured is x and F, each with white noise. The
best linear approximation is the mean of F(k)/X(k) over ``AVERAGED`` other realisations of the same lines (Pintelon &
Schoukens, 2012, chapter 3); its error is 1/√AVERAGED of the distortion of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmarks.known_system import Known
from excitation.analysis import Measurement, Realisation
from excitation.lines import Lines, band_lines, excited_lines

__all__ = ["FrictionCase", "friction_played"]

AVERAGED = 1000

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STIFFNESS_N_M, _DAMPING_N_S_M = 5e3, 1.5e3
_SLIP_M_S = 0.02
_GAS_N_M2, _ASYMMETRY_N_S_M = 2e5, 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionCase:
    """What is played, and the noise of the channels, rms of one sample."""

    lines: Lines = "odd-random"
    realisations: int = 1
    periods: int = 4
    slope: float = -1.0  # displacement amplitude over frequency, as a power
    samples: int = 4096
    sample_rate_hz: float = 512.0
    band_hz: tuple[float, float] = (0.5, 30.0)
    displacement_rms_m: float = 0.005
    friction_n: float = 80.0
    displacement_noise_m: float = 2e-6
    force_noise_n: float = 1.0


def friction_played(case: FrictionCase, seed: int) -> Known:
    """Realisations of a case with phases and noise of a seed."""
    rng = np.random.default_rng(seed)
    driven, value = _approximation(case)
    last = min(5 * int(driven[-1]), (case.samples - 1) // 2)
    quiet = np.setdiff1d(np.arange(1, last + 1), driven)
    odd_quiet, even_quiet = quiet[quiet % 2 == 1], quiet[quiet % 2 == 0]
    runs, odd, even, both = [], 0.0, 0.0, 0.0
    for m in range(case.realisations):
        lines = _random(case, driven, rng)
        x, force = _motion(case, lines, driven), _force(case, lines, driven)
        found = np.fft.rfft(force) / case.samples
        rest = found[driven] - value * lines
        own = 2.0 * float(np.sum(np.abs(rest) ** 2))
        odd += (own + _power(found[odd_quiet])) / case.realisations
        even += _power(found[even_quiet]) / case.realisations
        both += (own + _power(found[quiet])) / case.realisations
        shape = (case.periods, case.samples)
        moved = x + case.displacement_noise_m * rng.standard_normal((1, *shape))
        noisy = force + case.force_noise_n * rng.standard_normal(shape)
        runs.append(Realisation(name=f"run {m + 1}", inputs=moved, force=noisy))
    measurement = Measurement(sample_rate_hz=case.sample_rate_hz, inputs=("displacement",), realisations=tuple(runs))
    levels = {name: float(np.sqrt(power)) for name, power in (("odd", odd), ("even", even), ("both", both))}
    return Known(measurement=measurement, driven=driven, value=value, **levels)


def _power(coefficients: Complex) -> float:
    return 2.0 * float(np.sum(np.abs(coefficients) ** 2))


@cache
def _approximation(case: FrictionCase) -> tuple[NDArray[np.int64], Complex]:
    """The driven lines of the case, (K,), and G on them, N/m."""
    n, rate = case.samples, case.sample_rate_hz
    driven = excited_lines(band_lines(*case.band_hz, rate, n), case.lines, 4, 1)[0]
    rng = np.random.default_rng(0)
    total = np.zeros(driven.size, dtype=np.complex128)
    for _ in range(AVERAGED):
        lines = _random(case, driven, rng)
        total += np.fft.rfft(_force(case, lines, driven))[driven] / n / lines
    return driven, total / AVERAGED


def _random(case: FrictionCase, driven: NDArray[np.int64], rng: np.random.Generator) -> Complex:
    """Fourier coefficients of the displacement on the driven lines."""
    size = driven.astype(np.float64) ** case.slope
    size *= case.displacement_rms_m / np.sqrt(2.0 * np.sum(size**2))
    return np.asarray(size * np.exp(2j * np.pi * rng.random(driven.size)))


def _motion(case: FrictionCase, lines: Complex, driven: NDArray[np.int64]) -> Floats:
    spectrum = np.zeros(case.samples // 2 + 1, dtype=np.complex128)
    spectrum[driven] = lines * case.samples
    return np.fft.irfft(spectrum, n=case.samples)


def _force(case: FrictionCase, lines: Complex, driven: NDArray[np.int64]) -> Floats:
    omega = 2.0 * np.pi * driven * (case.sample_rate_hz / case.samples)
    x, v = _motion(case, lines, driven), _motion(case, 1j * omega * lines, driven)
    odd = _STIFFNESS_N_M * x + _DAMPING_N_S_M * v + case.friction_n * np.tanh(v / _SLIP_M_S)
    return np.asarray(odd + _GAS_N_M2 * x**2 + _ASYMMETRY_N_S_M * np.abs(v))
