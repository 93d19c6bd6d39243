"""Lines of a realisation: the mean over its periods, what differs between them, and how that changes in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.measurement import Realisation

__all__ = ["LineSpectra", "line_spectra", "noise_beside", "power_between", "rms_lines"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineSpectra:
    """Lines 0 … N/2 of one realisation, as rms values: the squares of a signal's lines add up to its mean square."""

    name: str
    periods: int
    inputs: Complex  # (I, L): mean over the periods
    force: Complex  # (L,)
    input_noise: Floats  # (I, L): variance of a line of one period, from successive periods
    noise: Floats  # (L,), N²: the same of the force; 0 where there is one period
    total: Floats  # (L,), N²: variance of a line about its mean over the periods: noise and slow change
    each: Complex  # (P, L): the force of each period
    each_input: Complex  # (I, P, L): the inputs of each period

    @property
    def freedom(self) -> float:
        """Complex degrees of freedom of ``noise`` on one line; 0 where there is one period."""
        return _freedom(self.periods)


def line_spectra(realisation: Realisation) -> LineSpectra:
    """Mean spectra and the variances of their lines.

    noise(k) = Σ|Y_{p+1} − Y_p|²/(2(P − 1)), total(k) = Σ|Y_p − Ȳ|²/(P − 1): both are the variance of white noise, and a
    slow change adds to the second only (von Neumann, 1941).
    """
    inputs, force = rms_lines(realisation.inputs), rms_lines(realisation.force)
    count = realisation.periods
    total = np.zeros(force.shape[1])
    if count > 1:
        total = np.sum(np.abs(force - force.mean(axis=0)) ** 2, axis=0) / (count - 1)
    return LineSpectra(
        name=realisation.name,
        periods=count,
        inputs=inputs.mean(axis=1),
        force=force.mean(axis=0),
        input_noise=power_between(inputs),
        noise=power_between(force),
        total=total,
        each=force,
        each_input=inputs,
    )


def noise_beside(one: LineSpectra, g: Complex, lines: NDArray[np.int64]) -> Floats:
    """Variance of Y − Σ G_i·U_i of one period on lines, (K,), N²; ``g`` (I, K), NaN where an input makes nothing.

    It holds the noise of the inputs too, |G|²·σ_u² where that is independent of the noise of the force, and leaves out
    what the force makes of a motion that truly differs from period to period.
    """
    made = np.sum(np.nan_to_num(g)[:, None, :] * one.each_input[:, :, lines], axis=0)
    return power_between(one.each[:, lines] - made)


def rms_lines(periods: Floats) -> Complex:
    """The DFT of real periods (…, N) as rms values of the lines, (…, N // 2 + 1)."""
    spectra: Complex = np.fft.rfft(periods, axis=-1) * (np.sqrt(2.0) / periods.shape[-1])
    spectra[..., 0] /= np.sqrt(2.0)
    if periods.shape[-1] % 2 == 0:
        spectra[..., -1] /= np.sqrt(2.0)
    return spectra


def power_between(spectra: Complex) -> Floats:
    """Variance of a line of one period from successive periods (…, P, L), (…, L); 0 where there is one."""
    count = spectra.shape[-2]
    if count < 2:
        return np.zeros((*spectra.shape[:-2], spectra.shape[-1]))
    steps = np.abs(np.diff(spectra, axis=-2)) ** 2
    out: Floats = np.sum(steps, axis=-2) / (2.0 * (count - 1))
    return out


def _freedom(periods: int) -> float:
    """Of half the mean square successive difference: (P − 1)²/(3P − 4) normal pairs (von Neumann, 1941)."""
    return 0.0 if periods < 2 else 2.0 * (periods - 1) ** 2 / (3.0 * periods - 4.0)
