"""Drive-file iteration: the drive that makes the measured motion equal the wanted one. Pure: no rig, no file.

The rig's frequency response is measured with the damper in place; every step adds to the drive the
remaining error times the inverse response. (De Cuyper, Verhaegen & Swevers, Control Engineering Practice 11, 2003:
off-line iteration with an inverse model for service-load simulation.)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import IterationError

SMOOTHING_HZ = 0.5  # half width over which spectra are averaged
ENERGY = 1.0 - 1e-7  # share of the target's energy below the bandwidth, where none is given


@dataclass(frozen=True, slots=True, kw_only=True)
class IterationSettings:
    """Step size, bandwidth and end of the iteration."""

    gain: float = 0.9  # share of the error that one step corrects; below 1 against errors of the response
    bandwidth_hz: float | None = None  # no correction above; None: where the target's motion ends
    regularisation: float = 0.05  # where the response is smaller than this, the inverse is small too
    tolerance: float = 0.01  # rms of the error over rms of the target
    most: int = 5  # iterations after the plain command

    def __post_init__(self) -> None:
        for name, low, high in (("gain", 0.0, 1.5), ("regularisation", 0.0, 1.0), ("tolerance", 0.0, 1.0)):
            value = getattr(self, name)
            if not (isfinite(value) and low < value <= high):
                raise IterationError(f"{name} is {value}: it must lie above {low:g} and not above {high:g}")
        if self.bandwidth_hz is not None and not (isfinite(self.bandwidth_hz) and self.bandwidth_hz > 0):
            raise IterationError(f"bandwidth is {self.bandwidth_hz} Hz: it must be positive")
        if self.most < 1:
            raise IterationError(f"iterations is {self.most}: it must be 1 or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """The rig's frequency response over the DFT bins of one block."""

    frequency_hz: NDArray[np.float64]  # (K,)
    gain: NDArray[np.complex128]  # (K,), measured over commanded displacement
    coherence: NDArray[np.float64]  # (K,), share of the motion that the drive explains, 0 … 1


def frequency_response(
    drive_m: NDArray[np.float64], measured_m: NDArray[np.float64], sample_rate_hz: float, *, periodic: bool
) -> Response:
    """Estimate the rig's frequency response from one block of drive and motion.

    H = S_yu / S_uu, coherence = |S_yu|² / (S_uu S_yy), spectra averaged over ±0.5 Hz; a block that is not
    periodic is tapered by a Hann window first.

    Parameters
    ----------
    drive_m, measured_m : (N,) arrays, m
    """
    n = drive_m.size
    window = np.ones(n) if periodic else np.hanning(n)
    u = np.fft.rfft((drive_m - drive_m.mean()) * window)
    y = np.fft.rfft((measured_m - measured_m.mean()) * window)
    width = max(round(SMOOTHING_HZ * n / sample_rate_hz), 1)
    uu, yy = _smooth(np.abs(u) ** 2, width).real, _smooth(np.abs(y) ** 2, width).real
    yu = _smooth(y * np.conj(u), width)
    floor = 1e-14 * float(uu.max(initial=0.0)) or 1.0
    return Response(
        frequency_hz=np.asarray(np.fft.rfftfreq(n, 1 / sample_rate_hz), dtype=np.float64),
        gain=yu / np.maximum(uu, floor),
        coherence=np.clip(np.abs(yu) ** 2 / (np.maximum(uu, floor) * np.maximum(yy, floor)), 0.0, 1.0),
    )


def _smooth(spectrum: NDArray[np.complexfloating] | NDArray[np.floating], width: int) -> NDArray[np.complex128]:
    """Average over 2·width + 1 bins, fewer at the ends."""
    total = np.concatenate([[0], np.cumsum(spectrum.astype(np.complex128))])
    index = np.arange(spectrum.size)
    low, high = np.maximum(index - width, 0), np.minimum(index + width + 1, spectrum.size)
    smoothed: NDArray[np.complex128] = (total[high] - total[low]) / (high - low)
    return smoothed


def inverse(response: Response, settings: IterationSettings, bandwidth_hz: float) -> NDArray[np.complex128]:
    """Regularised inverse of a response, (K,).

    Q·γ²·H* / (|H|² + λ²): λ the regularisation, γ² the coherence, Q 1 up to the bandwidth, then a cosine to 0 at
    1.25 times it.
    """
    h, f = response.gain, response.frequency_hz
    roll = np.clip((f / bandwidth_hz - 1.0) / 0.25, 0.0, 1.0)
    q = 0.5 * (1.0 + np.cos(np.pi * roll))
    trusted = q * response.coherence / (np.abs(h) ** 2 + settings.regularisation**2)
    return np.asarray(trusted * np.conj(h), dtype=np.complex128)


def corrected(
    drive_m: NDArray[np.float64], error_m: NDArray[np.float64], inverse: NDArray[np.complex128], gain: float
) -> NDArray[np.float64]:
    """Drive corrected by a share of the error: u + g·F⁻¹(H⁻¹·F(e)), (N,) arrays, m."""
    step: NDArray[np.float64] = np.fft.irfft(inverse * np.fft.rfft(error_m), n=error_m.size)
    return drive_m + gain * step


def relative_error(measured_m: NDArray[np.float64], target_m: NDArray[np.float64]) -> float:
    """Rms of measured − target over rms of the target about its mean."""
    return float(np.sqrt(np.mean((measured_m - target_m) ** 2)) / np.std(target_m))


def natural_bandwidth_hz(target_m: NDArray[np.float64], sample_rate_hz: float) -> float:
    """Frequency below which the share ENERGY of a target's energy lies, Hz."""
    window = np.hanning(target_m.size)
    power = np.abs(np.fft.rfft((target_m - target_m.mean()) * window)) ** 2
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    frequency = np.fft.rfftfreq(target_m.size, 1 / sample_rate_hz)
    return float(frequency[int(np.searchsorted(share, ENERGY))])
