"""Phases of a low crest factor: Schroeder's formula, and the L_p norm with rising p."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from excitation.lbfgs import minimise
from excitation.portable_math import cosine_and_sine, uniform

__all__ = ["crest_factor_of", "low_crest", "schroeder"]

_EXPONENTS = (4, 16, 64, 256, 1024)
_MANY = 2**20  # samples of the fine grid beyond which fewer evaluations keep the time below half a minute
_OVERSAMPLING = 32  # samples per period of the highest line, while the peak is sought


def schroeder(amplitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Phases in turns (1 turn = 2π rad), (K,), of neighbouring lines with these amplitudes.

    φ_k = −Σ_{l<k} (k − l)·p_l, p the relative powers: the instantaneous frequency
    sweeps the band with a dwell proportional to the power.

    References
    ----------
    Schroeder, IEEE Trans. Inf. Theory 16 (1970): synthesis of low-peak-factor signals.
    """
    power = amplitude * amplitude
    below = np.cumsum(power / power.sum())
    turns = -np.concatenate([[0.0], np.cumsum(below[:-1])])
    return np.asarray(turns - np.floor(turns))


def crest_factor_of(
    lines: NDArray[np.int64], amplitude: NDArray[np.float64], phase_turns: NDArray[np.float64]
) -> float:
    """max abs(u)/rms(u) of the continuous signal, its peak sought on a grid 64 times the highest line."""
    signal = _Signal(lines, amplitude, 64)(phase_turns)[0]
    return float(np.abs(signal).max() / np.sqrt(0.5 * np.sum(amplitude * amplitude)))


def low_crest(
    lines: NDArray[np.int64],
    amplitude: NDArray[np.float64],
    *,
    seed: int = 0,
    goal: float = 1.0,
    starts: int = 60,
    evaluations: int | None = None,
) -> NDArray[np.float64]:
    """Phases in turns, (K,), of the lowest crest factor found from Schroeder's and ``starts`` − 1 random
    phases.

    Minimises ‖u‖_p by phases for p = 4, 16 … 1024, each from the result before. Ends early at ``goal`` or
    when the signal was evaluated so many times (by default 4 000 times, fewer on more than 3 072 samples).

    References
    ----------
    Guillaume, Schoukens, Pintelon & Kollár, IEEE Trans. Instrum. Meas. 40 (1991): crest factor by L_p norms.
    """
    signal = _Signal(lines, amplitude, _OVERSAMPLING)
    budget = evaluations or min(4000, max(min(200, 200 * _MANY // signal.samples), 3000 * 4096 // signal.samples))
    each = min(100, max(10, budget // len(_EXPONENTS)))
    best_phases = schroeder(amplitude)
    best = crest_factor_of(lines, amplitude, best_phases)
    for start in range(starts):
        phases = schroeder(amplitude) if start == 0 else uniform((seed, 4, start), lines.size)
        for exponent in _EXPONENTS:
            found = minimise(partial(signal.norm, exponent), phases, iterations=each, first_step=0.02, tolerance=1e-5)
            phases = found.x
        crest = crest_factor_of(lines, amplitude, phases)
        if crest < best:
            best, best_phases = crest, phases
        if best <= goal or signal.evaluations > budget:
            break
    return best_phases - np.floor(best_phases)


class _Signal:
    """The signal on a fine grid, and its L_p norm with the gradient by phases."""

    def __init__(self, lines: NDArray[np.int64], amplitude: NDArray[np.float64], oversampling: int) -> None:
        self.samples = 2 ** int(np.ceil(np.log2(oversampling * int(lines.max()))))
        self.lines, self.amplitude, self.evaluations = lines, amplitude, 0

    def __call__(self, turns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        cos, sin = cosine_and_sine(turns)
        spectrum = np.zeros(self.samples // 2 + 1, dtype=np.complex128)
        spectrum.real[self.lines] = self.amplitude * cos
        spectrum.imag[self.lines] = self.amplitude * sin
        phasor = spectrum[self.lines]
        return np.fft.irfft(spectrum, n=self.samples, norm="forward") * 0.5, phasor

    def norm(self, exponent: int, turns: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """‖u‖_p = peak·(mean (u/peak)^p)^(1/p), and its gradient by the phases in turns. p is a power of two:
        squares and square roots give the same bits on every processor."""
        self.evaluations += 1
        signal, phasor = self(turns)
        peak = float(np.abs(signal).max())
        relative = signal / peak
        power = np.abs(relative)
        for _ in range(exponent.bit_length() - 1):
            power = power * power
        mean = float(power.sum()) / self.samples
        steep = np.divide(power, relative, out=np.zeros_like(power), where=power > 0.0)
        slope = steep / (peak * mean * self.samples)
        g = np.fft.rfft(slope)[self.lines]
        value = mean
        for _ in range(exponent.bit_length() - 1):
            value = float(np.sqrt(value))
        value *= peak
        return value, (-2.0 * np.pi * value) * (phasor.imag * g.real - phasor.real * g.imag)
