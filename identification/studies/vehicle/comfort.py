"""Ride comfort: frequency weightings of ISO 2631-1, weighted acceleration and vibration dose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighting:
    """Band limit f1 … f2, acceleration–velocity transition f3, f4, Q4 and upward step f5, Q5, f6, Q6; Hz.

    A step whose f5 is infinite is left out; so is the zero of the transition where f3 is infinite.
    """

    f1: float = 0.4
    f2: float = 100.0
    f3: float
    f4: float
    q4: float = 0.63
    f5: float = np.inf
    q5: float = 0.0
    f6: float = np.inf
    q6: float = 0.0

    def response(self, frequency_hz: Floats) -> Complex:
        """The complex weight at each frequency, (K,)."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        w1, w2, w3, w4 = (2.0 * np.pi * f for f in (self.f1, self.f2, self.f3, self.f4))
        root = np.sqrt(2.0)
        high = s**2 / (s**2 + root * w1 * s + w1**2)
        low = 1.0 / (1.0 + root * s / w2 + (s / w2) ** 2)
        transition = (1.0 + s / w3) / (1.0 + s / (self.q4 * w4) + (s / w4) ** 2)
        weight = high * low * transition
        if np.isfinite(self.f5):
            w5, w6 = 2.0 * np.pi * self.f5, 2.0 * np.pi * self.f6
            up = 1.0 + s / (self.q5 * w5) + (s / w5) ** 2
            weight = weight * up / (1.0 + s / (self.q6 * w6) + (s / w6) ** 2) * (w5 / w6) ** 2
        return np.asarray(weight, dtype=np.complex128)


WEIGHTINGS: Final[Mapping[str, Weighting]] = {
    "Wk": Weighting(f3=12.5, f4=12.5, f5=2.37, q5=0.91, f6=3.35, q6=0.91),  # vertical, on a seat
    "Wd": Weighting(f3=2.0, f4=2.0),  # fore-and-aft and lateral, on a seat
    "Wc": Weighting(f3=8.0, f4=8.0),  # fore-and-aft, at the back
    "Wf": Weighting(f1=0.08, f2=0.63, f3=np.inf, f4=0.25, q4=0.86, f5=0.0625, q5=0.80, f6=0.1, q6=0.80),  # sickness
}
"""ISO 2631-1:1997, Annex A, Table A.1: the parameters of the transfer functions."""

_WORDS: Final = (  # ISO 2631-1:1997, C.2.3: m/s², whose ranges overlap; here each ends where the next is named
    (0.315, "not uncomfortable"),
    (0.5, "a little uncomfortable"),
    (0.8, "fairly uncomfortable"),
    (1.25, "uncomfortable"),
    (2.0, "very uncomfortable"),
    (np.inf, "extremely uncomfortable"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Comfort:
    """Weighted rms, m/s²; its highest over one second (MTVV), m/s²; vibration dose of the record (VDV), m/s^1.75."""

    rms: float
    highest: float
    dose: float

    @property
    def words(self) -> str:
        """What most people would say."""
        return next(word for limit, word in _WORDS if self.rms < limit)


def weighted(acceleration: Floats, sample_rate_hz: float, weighting: Weighting) -> Floats:
    """The weighted acceleration, (N,), m/s², of a record that is taken as it is, padded with as much silence."""
    n = acceleration.size
    spectrum = np.fft.rfft(acceleration, n=2 * n)
    weights = weighting.response(np.asarray(np.fft.rfftfreq(2 * n, 1.0 / sample_rate_hz), dtype=np.float64))
    return np.asarray(np.fft.irfft(spectrum * weights, n=2 * n)[:n])


def comfort(acceleration: Floats, sample_rate_hz: float, *, weighting: str = "Wk", settle_s: float = 0.0) -> Comfort:
    """Comfort of an acceleration (N,), m/s², after the first `settle_s` seconds; raises DataError.

    a_w = sqrt(mean a_w(t)²), MTVV = max over t of the rms of the last second, VDV = (∫ a_w⁴ dt)^(1/4).

    References
    ----------
    ISO 2631-1:1997, 6.1, 6.3.1 and 6.3.2; the running mean of 6.3.1 is the linear one.
    """
    if weighting not in WEIGHTINGS:
        raise DataError(f"weighting is {weighting!r}: use {', '.join(WEIGHTINGS)}")
    skip, second = round(settle_s * sample_rate_hz), max(1, round(sample_rate_hz))
    if acceleration.size - skip < second:
        raise DataError(f"{acceleration.size} samples less {settle_s:g} s of settling: a second is the least")
    square = weighted(acceleration, sample_rate_hz, WEIGHTINGS[weighting])[skip:] ** 2
    sums = np.concatenate([[0.0], np.cumsum(square)])
    running = (sums[second:] - sums[:-second]) / second
    return Comfort(
        rms=float(np.sqrt(np.mean(square))),
        highest=float(np.sqrt(max(running.max(), 0.0))),
        dose=float((np.sum(square**2) / sample_rate_hz) ** 0.25),
    )
