"""The block of a record that is transformed, and its spectra: mean of the steady periods, or the whole record. Pure.

A record without a period is extended before its transform: its error by a smooth return from the last value to the
first, so that neither a step between them nor the inverse response carries the end over to the beginning; for the
response it is tapered by a Hann window instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigctl.response import Lines, lines_of

__all__ = ["Blocks", "blocks_of"]

PAD_S = 0.5  # of extension: an inverse response with a bandwidth of a few hertz has decayed by then


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blocks:
    """Cuts records, (N, C), relative channels, into blocks and transforms them: spectra are rfft/length."""

    samples: int  # of a record
    period: int  # 0: the record is not periodic
    padded: int  # length of the transform
    lines: Lines

    @property
    def steady(self) -> slice:
        """Samples of a record after the first period, in which the motion settles."""
        return slice(self.period, None)

    def periods(self, record: NDArray[np.float64]) -> NDArray[np.float64]:
        """Steady periods, (P, period, C)."""
        whole = self.samples // self.period * self.period
        return record[self.period : whole].reshape(-1, self.period, record.shape[1])

    def block(self, record: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.periods(record).mean(axis=0) if self.period else record

    def spectra(self, record: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Spectra of an error or a step, (K, C)."""
        block = self.block(record)
        if not self.period:
            count = self.padded - self.samples
            share = 0.5 * (1.0 - np.cos(np.pi * np.arange(1, count + 1) / (count + 1)))
            block = np.concatenate([block, block[-1] + share[:, None] * (block[0] - block[-1])])
        return np.fft.rfft(block, axis=0) / self.padded

    def tapered(self, record: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Spectra for a response, (K, C): without the mean, of the power of a record that is not tapered."""
        block = self.block(record)
        block = block - block.mean(axis=0)
        if not self.period:
            window = np.hanning(block.shape[0])
            block = block * (window / np.sqrt(np.mean(window**2)))[:, None]
        return np.fft.rfft(block, n=self.padded, axis=0) / self.padded

    def record(self, spectra: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Record of a spectrum, (N, C): period after period, or the part that is played."""
        block = np.fft.irfft(spectra * self.padded, n=self.padded, axis=0)
        return np.resize(block, (self.samples, block.shape[1]))

    def mean_square(self, power: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean square of a record's channels, (C,), from the power of its lines, (K, C)."""
        total: NDArray[np.float64] = 2.0 * power.sum(axis=0) - power[0]
        return total * (self.padded / (self.period or self.samples))


def blocks_of(samples: int, period_samples: int, sample_rate_hz: float, channels: int) -> Blocks:
    """Blocks of records of a target; a period is used where at least two are played, since the first one settles."""
    period = period_samples if period_samples and samples >= 2 * period_samples else 0
    padded = period or samples + max(round(PAD_S * sample_rate_hz), 1)
    lines = lines_of(period or samples, padded, sample_rate_hz, channels, periodic=bool(period))
    return Blocks(samples=samples, period=period, padded=padded, lines=lines)
