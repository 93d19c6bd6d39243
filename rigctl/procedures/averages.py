"""The mean of a correlated series, with a standard uncertainty that knows the correlation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WINDOW = 5.0  # correlation times: beyond this lag the sum of the autocorrelation adds more noise than correlation


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean:
    """A mean and its standard uncertainty."""

    value: float
    standard_deviation: float  # of one value
    uncertainty: float  # of the mean
    correlation_samples: float  # samples that count as one; 1 for white noise


def mean_of(values: NDArray[np.float64], *, resolution: float = 0.0) -> Mean:
    """Mean of a series (n,), n ≥ 2.

    u² = s² τ / n + resolution² / 12, with τ = 1 + 2 Σ ρ(k) over the lags k < 5 τ, at least 1. Where the correlation is
    as long as the series, τ is limited to n / 2: the uncertainty is then that of one value.

    References
    ----------
    Sokal, Monte Carlo methods in statistical mechanics, 1996: the automatic window of the autocorrelation.
    JCGM 100:2008, F.2.2.1: a resolution δ contributes δ / √12.
    """
    n = values.size
    deviation = float(np.std(values, ddof=1))
    tau = correlation_samples(values)
    uncertainty = np.sqrt(deviation**2 * tau / n + resolution**2 / 12)
    return Mean(
        value=float(np.mean(values)),
        standard_deviation=deviation,
        uncertainty=float(uncertainty),
        correlation_samples=tau,
    )


def correlation_samples(values: NDArray[np.float64]) -> float:
    """Integrated autocorrelation time of a series in samples, 1 … n / 2."""
    n = values.size
    centred = values - np.mean(values)
    power = float(np.dot(centred, centred))
    if power == 0 or n < 4:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * n)
    rho = np.fft.irfft(np.abs(spectrum) ** 2)[: n // 2] / power
    taus = 2.0 * np.cumsum(rho) - 1.0
    enough = np.flatnonzero(np.arange(taus.size) >= WINDOW * np.maximum(taus, 0.0))
    tau = float(taus[enough[0]]) if enough.size else n / 2
    return min(max(tau, 1.0), n / 2)
