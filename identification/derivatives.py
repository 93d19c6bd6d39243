"""Motion from a displacement that repeats: exact derivatives of its mean period; and the bands of periodic signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.sliding import running_mean

Floats = NDArray[np.float64]

_LINE_SIGMA = 3.5  # a displacement line is kept when it is this far above its noise: by chance 5e-6 of lines are
_STAIRS = 8.0  # times the rounding's mean line: for a simple motion the rounding is concentrated on few lines
_FEW = 0.5  # distinct values for each sample: fewer show the steps of a converter
_ROUNDED = 1e-9  # of the highest line: rounding, not a line
_NOT_CHANCE = 8  # lines: noise alone gives as many once in two hundred thousand
_BEYOND = 4.0  # times the noise there: what a linear machine would show beyond the last line of the force
_MATERIAL = 1e-3  # of the force


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Displacement, velocity and acceleration, each (N,) float64, SI, and their highest frequency, Hz.

    `noise` holds how the same three stray with the noise of the displacement sensor, each (P, N): for every period as
    it was measured, or, of a record without periods (P = 1), as a draw of noise of the level seen beyond its band.
    """

    x: Floats
    v: Floats
    a: Floats
    bandwidth_hz: float
    noise: tuple[Floats, Floats, Floats]


def periodic_kinematics(periods: Floats, sample_rate_hz: float) -> Kinematics:
    """One period of motion from P measured ones.

    The mean period is differentiated line by line, X·(jω)ⁿ, which is exact because it is periodic (Witters & Swevers,
    2009). Only lines that stand 3.5 σ above the noise between the periods are kept: all the others are noise, and
    differentiation would amplify it with the frequency.

    Parameters
    ----------
    periods : (P, N) float64, m
    """
    n = periods.shape[1]
    spectra = np.fft.rfft(periods, axis=1)
    mean = spectra.mean(axis=0)
    rounding = n * rounding_of(periods)
    variance, stray = _line_noise(spectra, rounding)
    # The last digits of a number are noise that does not differ between periods.
    step = np.finfo(np.float64).eps * np.max(np.abs(periods), initial=0.0) * np.sqrt(n)
    keep = np.abs(mean) > np.maximum(_LINE_SIGMA * np.sqrt(variance), max(10.0 * step, _STAIRS * np.sqrt(rounding)))
    keep[0] = True
    mean = np.where(keep, mean, 0.0)
    if n % 2 == 0:
        mean[-1] = 0.0
    omega = 2.0 * np.pi * np.fft.rfftfreq(n, 1.0 / sample_rate_hz)
    x, v, a = (np.fft.irfft(mean * (1j * omega) ** k, n) for k in range(3))
    highest = float(omega[np.flatnonzero(np.abs(mean[1:]) > 0)[-1] + 1] if np.any(mean[1:]) else 0.0)
    stray = np.where((np.abs(mean) > 0.0) & (omega > 0.0), stray, 0.0)
    dx, dv, da = (np.fft.irfft(stray * (1j * omega) ** k, n, axis=1) for k in range(3))
    return Kinematics(x, v, a, highest / (2.0 * np.pi), (dx, dv, da))


def _line_noise(spectra: NDArray[np.complex128], rounding: float) -> tuple[Floats, NDArray[np.complex128]]:
    """Variance of the mean of `spectra` (P, L) per line, (L,), and how each of them strays from it.

    A `rounding` (its power per line) that the noise does not blur is the same in every period: it does not average out.
    """
    count, lines = spectra.shape
    mean = spectra.mean(axis=0)
    if count == 1:
        floor = float(np.median(np.abs(mean[3 * lines // 4 :]) ** 2) / np.log(2.0))
        variance = np.full(lines, max(floor, rounding))
        return variance, draw(variance[None, :])
    stray = spectra - mean
    single = np.sum(np.abs(stray) ** 2, axis=0) / (count - 1)
    single[0] = single[min(1, lines - 1)]  # a drifting mean says nothing about the lines beside it
    variance = np.maximum(running_mean(single, min(17, lines)), 0.0) / count
    if float(np.mean(single)) < rounding:
        variance = variance + rounding
        stray = stray + draw(np.full((count, lines), rounding * count))
    return variance, stray


def rounding_of(x: Floats) -> float:
    """Variance of the rounding of a channel, q²/12, where it takes few distinct values; 0 where it takes many."""
    steps = np.unique(x)
    return float(np.median(np.diff(steps))) ** 2 / 12.0 if 1 < steps.size < _FEW * x.size else 0.0


def draw(variance: Floats) -> NDArray[np.complex128]:
    """Spectra of noise with the given power per line, shaped like it; always the same ones."""
    rng = np.random.default_rng(0)
    drawn: NDArray[np.complex128] = np.sqrt(0.5 * variance) * (
        rng.standard_normal(variance.shape) + 1j * rng.standard_normal(variance.shape)
    )
    return drawn


def band_of_drive(motion: Kinematics, force: Floats, sample_rate_hz: float) -> float | None:
    """The band, Hz, of a force that drives a machine, where the motion goes on beyond the last line of the force.

    What a mass makes of the motion's harmonics there only cancels what the machine's own forces make of them, and the
    difference is lost with the lines that the noise hides. None where the force of a linear machine with that motion
    would show nothing beyond the last line either.

    Parameters
    ----------
    force : (P, N) float64, N, the periods of a run
    """
    n = force.shape[1]
    spectra = np.fft.rfft(force, axis=1)
    mean, variance = spectra.mean(axis=0), _line_noise(spectra, 0.0)[0]
    step = 10.0 * np.finfo(np.float64).eps * np.max(np.abs(force)) * np.sqrt(n)
    shown = np.abs(mean) > np.maximum(_LINE_SIGMA * np.sqrt(variance), step)
    last = int(np.flatnonzero(shown)[-1]) if np.any(shown) else 0
    if not 3 < last < mean.size - 1:
        return None
    size = [max(float(np.std(s)), 1e-300) for s in (motion.x, motion.v, motion.a)]
    lines = np.column_stack([np.fft.rfft(s / q) for s, q in zip((motion.x, motion.v, motion.a), size, strict=True)])
    inner, beyond = lines[1 : last + 1], lines[last + 1 :]
    if np.sum(np.abs(beyond[:, 0]) > _ROUNDED * np.max(np.abs(inner[:, 0]))) < _NOT_CHANCE:
        return None
    stacked = np.concatenate([inner.real, inner.imag])
    share = np.linalg.lstsq(stacked, np.concatenate([mean.real[1 : last + 1], mean.imag[1 : last + 1]]), rcond=None)[0]
    made, noise = float(np.sum(np.abs(beyond @ share) ** 2)), float(np.sum(variance[last + 1 :]))
    whole = float(np.sum(np.abs(mean[1:]) ** 2))
    return float(last / n * sample_rate_hz) if made > max(_BEYOND * noise, _MATERIAL**2 * whole) else None


def low_pass_lines(signal: Floats, sample_rate_hz: float, bandwidth_hz: float) -> Floats:
    """The lines up to `bandwidth_hz` of a signal of whole periods, (N,) or (N, K)."""
    spectrum = np.fft.rfft(signal, axis=0)
    spectrum[np.fft.rfftfreq(len(signal), 1.0 / sample_rate_hz) > bandwidth_hz * (1.0 + 1e-9)] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(signal), axis=0))
