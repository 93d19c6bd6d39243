"""Motion from a measured displacement: exact derivatives for periodic runs, of stated bandwidth for others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

Floats = NDArray[np.float64]

_LINE_SIGMA = 6.0  # a displacement line counts when it stands this far above its own noise
_FLOOR_RATIO = 4.0  # the band of a free record ends where its spectrum meets this multiple of the floor


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Displacement, velocity and acceleration, each (N,) float64, SI, and the highest frequency they hold, Hz."""

    x: Floats
    v: Floats
    a: Floats
    bandwidth_hz: float


def periodic_kinematics(periods: Floats, sample_rate_hz: float) -> Kinematics:
    """One period of motion from P measured ones.

    The mean period is differentiated line by line, X·(jω)ⁿ, which is exact because it is periodic (Witters & Swevers,
    2009). Only lines that stand 6 σ above the noise between the periods are kept: all the others are noise, and
    differentiation would amplify it with the frequency.

    Parameters
    ----------
    periods : (P, N) float64, m
    """
    count, n = periods.shape
    spectra = np.fft.rfft(periods, axis=1)
    mean = spectra.mean(axis=0)
    if count > 1:
        variance = np.sum(np.abs(spectra - mean) ** 2, axis=0) / (count - 1) / count
        variance = np.maximum(uniform_filter1d(variance, min(17, variance.size), mode="nearest"), 0.0)
    else:
        floor = np.median(np.abs(mean[3 * mean.size // 4 :]) ** 2) / np.log(2.0)
        variance = np.full(mean.size, floor)
    # Rounding of the channel is noise that does not differ between periods.
    step = np.finfo(np.float64).eps * np.max(np.abs(periods), initial=0.0) * np.sqrt(n)
    keep = np.abs(mean) > np.maximum(_LINE_SIGMA * np.sqrt(variance), 10.0 * step)
    keep[0] = True
    mean = np.where(keep, mean, 0.0)
    if n % 2 == 0:
        mean[-1] = 0.0
    omega = 2.0 * np.pi * np.fft.rfftfreq(n, 1.0 / sample_rate_hz)
    x, v, a = (np.fft.irfft(mean * (1j * omega) ** k, n) for k in range(3))
    highest = float(omega[np.flatnonzero(np.abs(mean[1:]) > 0)[-1] + 1] if np.any(mean[1:]) else 0.0)
    return Kinematics(x, v, a, highest / (2.0 * np.pi))


def smooth_kinematics(x: Floats, sample_rate_hz: float) -> Kinematics:
    """Motion from a record without a period, through a zero-phase low-pass of stated bandwidth.

    The band ends where the spectrum of the (oddly extended, tapered) record falls to its noise floor; from there to one
    and a half times that frequency a raised cosine closes it. Good from some cycles of the band's end after the start.

    Parameters
    ----------
    x : (N,) float64, m
    """
    n = x.size
    line = np.linspace(x[0], x[-1], n)
    rest = x - line
    extended = np.concatenate([rest, -rest[-2:0:-1]])  # odd about both ends: no step, no corner in value
    spectrum = np.fft.rfft(extended)
    freq = np.fft.rfftfreq(extended.size, 1.0 / sample_rate_hz)
    edge = _band_edge(np.abs(spectrum) ** 2, freq)
    roll = np.clip((freq - edge) / (0.5 * edge), 0.0, 1.0)
    spectrum = spectrum * 0.5 * (1.0 + np.cos(np.pi * roll))
    omega = 2.0 * np.pi * freq
    out = [np.fft.irfft(spectrum * (1j * omega) ** k, extended.size)[:n] for k in range(3)]
    slope = (x[-1] - x[0]) / (n - 1) * sample_rate_hz
    return Kinematics(out[0] + line, out[1] + slope, out[2], edge)


def _band_edge(power: NDArray[np.floating], freq: NDArray[np.floating]) -> float:
    width = max(3, power.size // 200)
    smooth = uniform_filter1d(power, width, mode="nearest")
    floor = np.median(power[2 * power.size // 3 :]) / np.log(2.0)
    above = np.flatnonzero(smooth > _FLOOR_RATIO * max(floor, 1e-24 * float(np.max(power))))
    last = int(above[-1]) if above.size else 1
    return float(np.clip(freq[last], 4.0 * freq[1], 0.6 * freq[-1]))
