"""The frequency response of a rig with one or two driven channels, line by line, with its uncertainty. Pure.

Channels are relative: each is divided by the standard deviation of its target, so that a gain of 1 is a channel that
follows its command, and the responses of motion and current can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Evidence", "Lines", "Response", "forget", "learn", "lines_of", "measure", "response"]

Spectra: TypeAlias = NDArray[np.complex128]  # (K, C): line, channel

SMOOTHING_HZ = 0.5  # half width over which spectra are averaged: the phase of a 5 ms delay changes by 1° in it
HANN = 1.5  # noise bandwidth of the Hann window, in lines: so many lines of a tapered record are as one
# Standard deviations of a gain before anything is measured. A channel answers its own command about as 1: with 3 the
# measurement decides alone; half or double changes only lines without drive, which stay uncorrected.
OWN_GAIN = 3.0
# A channel answers the other one's command little. It decides only where both commands are proportional within ±0.5 Hz,
# as two sines of one frequency are: then the own command explains the channel. At half and double the same.
OTHER_GAIN = 0.1
# Share of its motion that a rig adds to a line as distortion, where that cannot be seen: with one commanded line within
# ±0.5 Hz, as a triangle's harmonics are, distortion looks like response. Servo-hydraulic axes have 0.1 … 1 %. With half
# of it the correction reaches 1.4 times as high in a triangle's harmonics, with double 0.7 times.
DISTORTION = 0.003
# Share of a channel's whole power that a line's residual has at least: the rounding of the running sums. A sensor with
# 1/10 000 of the motion as noise has 500 times as much in each of 2 000 lines.
ROUNDING = 1e-14
NOTHING = 1e-30  # power of a channel that stands still, m² or A² over the target's: far below any converter's count


@dataclass(frozen=True, slots=True)
class Lines:
    """The DFT lines of a block and how they are averaged."""

    frequency_hz: NDArray[np.float64]  # (K,)
    width: int  # a mean extends over this many lines to either side
    independent: float  # independent lines in a line: below 1 for a tapered and padded record

    def sums(self, values: NDArray[np.complexfloating] | NDArray[np.floating]) -> NDArray[np.complex128]:
        """Sum over 2·width + 1 lines, fewer at the ends, times the share that is independent; along axis 0."""
        total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values.astype(np.complex128), axis=0)])
        low, high = self._ends()
        return np.asarray(self.independent * (total[high] - total[low]), dtype=np.complex128)

    def power(self, spectra: Spectra) -> NDArray[np.float64]:
        """Mean square over the neighbouring lines, (K, C)."""
        low, high = self._ends()
        sums: NDArray[np.float64] = self.sums(np.abs(spectra) ** 2).real
        return np.maximum(sums / (self.independent * (high - low))[:, None], 0.0)

    @property
    def count(self) -> NDArray[np.float64]:
        """Independent lines in a sum, (K,)."""
        low, high = self._ends()
        return np.asarray(self.independent * (high - low), dtype=np.float64)

    def _ends(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        index = np.arange(self.frequency_hz.size)
        return np.maximum(index - self.width, 0), np.minimum(index + self.width + 1, index.size)


def lines_of(samples: int, padded: int, sample_rate_hz: float, channels: int, *, periodic: bool) -> Lines:
    """Lines of a block of `padded` samples, of which `samples` were measured.

    A mean holds more independent lines than there are channels, also in a short record.
    """
    independent = 1.0 if periodic else samples / padded / HANN
    width = max(round(SMOOTHING_HZ * padded / sample_rate_hz), ceil((channels + 1) / (2 * independent)))
    frequency = np.fft.rfftfreq(padded, 1 / sample_rate_hz)
    return Lines(np.asarray(frequency, dtype=np.float64), width, independent)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """What the rounds say about the response: per line and answering channel, in the form that adds up."""

    information: NDArray[np.complex128]  # (K, C, C, C): Σ u·uᴴ / r for each answering channel
    product: NDArray[np.complex128]  # (K, C, C): Σ y·uᴴ / r
    residual: NDArray[np.float64]  # (K, C): r, the power of a line that the response does not explain
    coherence: NDArray[np.float64]  # (K, C): share of a channel's power that the commands explain


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Response:
    """The rig's frequency response over the DFT lines of one block."""

    frequency_hz: NDArray[np.float64]  # (K,)
    gain: NDArray[np.complex128]  # (K, C, C): answering channel, commanded channel
    variance: NDArray[np.complex128]  # (K, C, C): E[δHᴴ·δH], the expected square of its error
    coherence: NDArray[np.float64]  # (K, C): share of a channel's power that the commands explain, 0 … 1


def measure(lines: Lines, drive: Spectra, answer: Spectra) -> Evidence:
    """Evidence of one block: y = H·u + e for the lines within ±0.5 Hz, e of equal power in them.

    H is the linear regression, the power of e its residual over the degrees of freedom; what repeats and is not
    linear counts as e too.
    """
    uu = _outer(lines, drive, drive)
    yu = _outer(lines, answer, drive)
    yy = lines.sums(np.abs(answer) ** 2).real
    floor = _rounding(answer)
    freedom = np.maximum(_commanded(lines, drive) - drive.shape[1], 0.0)[:, None]
    unseen = np.maximum(1.0 - freedom, 0.0) * _distortion(drive, answer)
    residual = 1e-6 * yy / lines.count[:, None] + floor
    rest = yy
    for _ in range(2):  # the prior's weight depends on the residual, and the other way round
        gain, _ = _posterior(uu[:, None] / residual[..., None, None], yu / residual[..., None])
        rest = _unexplained(gain, uu, yu, yy)
        residual = np.maximum((rest + unseen) / np.maximum(freedom, 1.0), floor)
    return Evidence(
        information=uu[:, None] / residual[..., None, None],
        product=yu / residual[..., None],
        residual=residual,
        coherence=np.clip(1.0 - rest / np.maximum(yy, NOTHING), 0.0, 1.0),
    )


def learn(evidence: Evidence, lines: Lines, step: Spectra, change: Spectra, power: NDArray[np.float64]) -> Evidence:
    """Evidence of a further round too: its drive changed by `step` and its answer by `change`, with error `power`."""
    power = np.maximum(power, _rounding(change))
    uu, yu = _outer(lines, step, step), _outer(lines, change, step)
    return Evidence(
        information=evidence.information + uu[:, None] / power[..., None, None],
        product=evidence.product + yu / power[..., None],
        residual=evidence.residual,
        coherence=evidence.coherence,
    )


def forget(evidence: Evidence, drifted: NDArray[np.float64]) -> Evidence:
    """Evidence after a change of the specimen that no step explains, of power (K, C): it counts as residual."""
    share = evidence.residual / (evidence.residual + drifted)
    return Evidence(
        information=share[..., None, None] * evidence.information,
        product=share[..., None] * evidence.product,
        residual=evidence.residual + drifted,
        coherence=evidence.coherence,
    )


def response(lines: Lines, evidence: Evidence) -> Response:
    """The response that the evidence makes most probable, and its uncertainty."""
    gain, variance = _posterior(evidence.information, evidence.product)
    return Response(
        frequency_hz=lines.frequency_hz, gain=gain, variance=variance.sum(axis=1), coherence=evidence.coherence
    )


def _posterior(
    information: NDArray[np.complex128], product: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Gain (K, C, C) and its variance for each answering channel (K, C, C, C), with the prior of both gains."""
    channels = product.shape[-1]
    expected = np.where(np.eye(channels, dtype=bool), OWN_GAIN, OTHER_GAIN)
    prior = np.stack([np.diag(row**-2.0) for row in expected]).astype(np.complex128)
    variance = np.asarray(np.linalg.inv(information + prior), dtype=np.complex128)
    return np.asarray(np.einsum("kic,kicd->kid", product, variance), dtype=np.complex128), variance


def _commanded(lines: Lines, drive: Spectra) -> NDArray[np.float64]:
    """Number of independent lines in a sum that hold the commands' power, (K,): (Σp)² / Σp²."""
    power = np.sum(np.abs(drive) ** 2, axis=1)
    total, squares = lines.sums(power).real, lines.sums(power**2).real
    ratio = np.maximum(total, 0.0) ** 2 / np.maximum(lines.independent * squares, NOTHING**2)
    return np.asarray(np.clip(lines.independent * ratio, 0.0, lines.count), dtype=np.float64)


def _distortion(drive: Spectra, answer: Spectra) -> NDArray[np.float64]:
    """Power of a line's distortion, (C,), where the lines say nothing of it: spread over as many as are commanded."""
    power = np.sum(np.abs(drive) ** 2, axis=1)
    spread = np.sum(power) ** 2 / max(float(np.sum(power**2)), NOTHING**2)
    whole: NDArray[np.float64] = np.sum(np.abs(answer) ** 2, axis=0)
    return DISTORTION**2 * whole / max(float(spread), 1.0)


def _rounding(spectra: Spectra) -> NDArray[np.float64]:
    """Least power of a line's residual, (C,)."""
    whole: NDArray[np.float64] = np.sum(np.abs(spectra) ** 2, axis=0)
    return np.maximum(ROUNDING * whole, NOTHING)


def _outer(lines: Lines, left: Spectra, right: Spectra) -> NDArray[np.complex128]:
    """Σ left·rightᴴ over the neighbouring lines, (K, C, C)."""
    return lines.sums(left[:, :, None] * np.conj(right[:, None, :]))


def _unexplained(
    gain: NDArray[np.complex128],
    uu: NDArray[np.complex128],
    yu: NDArray[np.complex128],
    yy: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Σ |y − H·u|² over the neighbouring lines, (K, C), from its sums."""
    explained = 2.0 * np.einsum("kic,kic->ki", gain, np.conj(yu)).real
    again = np.einsum("kic,kcd,kid->ki", gain, uu, np.conj(gain)).real
    return np.asarray(np.maximum(yy - explained + again, 0.0), dtype=np.float64)
