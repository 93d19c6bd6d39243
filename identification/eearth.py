"""EEARTH: phase, magnitude and slope of a simulated signal against a measured one, each scored from 0 to 1.

After Zhan, Fu & Yang, "Enhanced Error Assessment of Response Time Histories (EEARTH) metric", SAE 2011-01-0245:

- phase: the shift of greatest normalised correlation, ε_P = shift/N, score 1 − ε_P/0.2;
- magnitude: of the shifted signals C (simulated) and T (measured) after dynamic time warping,
  ε_M = ‖C − T‖₁/‖T‖₁ along the path, score 1 − ε_M/0.5;
- slope: of the derivatives of the shifted signals, ε_S = ‖C' − T'‖₁/‖T'‖₁, score 1 − ε_S/2;

all floored at zero. ISO/TS 18571 adopted these three with the same allowances (20 % shift, 0.5, 2.0, linear scores),
the warp held within 10 % of the record and the derivative averaged over nine intervals, and added a corridor score:
R = 0.4·corridor + 0.2·(phase + magnitude + slope). Deviations here, since a damper's record is periodic and long:
of several shifts of the same correlation the shortest counts, and the warp may reach no farther than `_CELLS` allow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SHIFT, _MAGNITUDE, _SLOPE = 0.2, 0.5, 2.0  # the errors at which each score is zero
_WARP = 0.1  # of the record
_CELLS: Final = 2e7  # of the warping band: 20 MB and some tenths of a second
_SAME = 1e-3  # correlations this close count as equal: a periodic signal has a maximum in every period
_INTERVALS = 9
_INNER, _OUTER = 0.05, 0.5  # of the largest measured value: the corridors of ISO/TS 18571


@dataclass(frozen=True, slots=True, kw_only=True)
class Eearth:
    """Scores from 0 to 1; `shift` in samples, positive where the measured signal is the later one."""

    phase: float
    magnitude: float
    slope: float
    corridor: float
    shift: int

    @property
    def score(self) -> float:
        """0.2·magnitude + 0.4·phase + 0.4·slope: the weights of a yaw-damper study."""
        return 0.2 * self.magnitude + 0.4 * self.phase + 0.4 * self.slope

    @property
    def iso_18571(self) -> float:
        """0.4·corridor + 0.2·phase + 0.2·magnitude + 0.2·slope."""
        return 0.4 * self.corridor + 0.2 * (self.phase + self.magnitude + self.slope)


def eearth(measured: Floats, simulated: Floats) -> Eearth:
    """Scores of a simulated signal (N,) against a measured one (N,), same unit."""
    n, shift = measured.size, _best_shift(measured, simulated)
    t = measured[max(0, shift) : n + min(0, shift)]
    c = simulated[max(0, -shift) : n - max(0, shift)]
    half = int(min(_WARP * t.size, 0.5 * _CELLS / t.size))
    distance, size = _warped(c, t, max(half, 1))
    rise_t, rise_c = _smooth_slope(t), _smooth_slope(c)
    return Eearth(
        phase=_scored(abs(shift) / n, _SHIFT),
        magnitude=_scored(distance / size, _MAGNITUDE) if size > 0.0 else 0.0,
        slope=_scored(float(np.abs(rise_c - rise_t).sum()) / max(float(np.abs(rise_t).sum()), 1e-300), _SLOPE),
        corridor=_corridor(measured, simulated),
        shift=shift,
    )


def _scored(error: float, allowed: float) -> float:
    return max(0.0, 1.0 - error / allowed)


def _corridor(measured: Floats, simulated: Floats) -> float:
    top = float(np.max(np.abs(measured)))
    distance = np.abs(simulated - measured) / max(top, 1e-300)
    return float(np.mean(np.clip((_OUTER - distance) / (_OUTER - _INNER), 0.0, 1.0) ** 2))


def _best_shift(measured: Floats, simulated: Floats) -> int:
    """Samples by which the measured signal is behind the simulated one, of at most a fifth of the record."""
    n = measured.size
    a, b = measured - measured.mean(), simulated - simulated.mean()
    most = int(_SHIFT * n)
    lags = np.arange(-most, most + 1)
    length = 1 << (n + most).bit_length()  # no lag wraps round
    products = np.fft.irfft(np.fft.rfft(a, length) * np.conj(np.fft.rfft(b, length)), length)[lags]
    ends_a, ends_b = np.concatenate([[0.0], np.cumsum(a**2)]), np.concatenate([[0.0], np.cumsum(b**2)])
    later, earlier = np.maximum(lags, 0), np.maximum(-lags, 0)
    power_a = ends_a[n - earlier] - ends_a[later]
    power_b = ends_b[n - later] - ends_b[earlier]
    size = np.sqrt(np.maximum(power_a * power_b, 0.0))
    height = np.divide(products, size, out=np.full(lags.size, -1.0), where=size > 0.0)
    peak = np.r_[True, height[1:] >= height[:-1]] & np.r_[height[:-1] >= height[1:], True]
    best = np.flatnonzero(peak & (height >= height.max() - _SAME))
    return int(lags[best[np.argmin(np.abs(lags[best]))]])


def _smooth_slope(a: Floats) -> Floats:
    """Change per sample, averaged over nine intervals."""
    kernel = np.ones(min(_INTERVALS, a.size - 1)) / min(_INTERVALS, a.size - 1)
    return np.convolve(np.diff(a), kernel, mode="valid")


@njit(cache=True)
def _warped(c: Floats, t: Floats, half: int) -> tuple[float, float]:
    """Sums of |c − t| and |t| along the path of least squared distance within `half` samples of the diagonal."""
    n, width = t.size, 2 * half + 1
    came = np.zeros((n, width), dtype=np.int8)  # 0 both, 1 c alone, 2 t alone
    before = np.full(width + 1, np.inf)
    now = np.full(width + 1, np.inf)
    for i in range(n):
        now[:] = np.inf
        for k in range(max(0, half - i), min(width, n - i + half)):
            j = i - half + k
            cost = (c[j] - t[i]) ** 2
            if i == 0 and j == 0:
                now[k] = cost
                continue
            both, up = before[k], before[k + 1]
            left = now[k - 1] if k > 0 else np.inf
            best, how = both, 0
            if left < best:
                best, how = left, 1
            if up < best:
                best, how = up, 2
            now[k] = cost + best
            came[i, k] = how
        before[:] = now
    distance, size = 0.0, 0.0
    i, j = n - 1, n - 1
    while True:
        distance += abs(c[j] - t[i])
        size += abs(t[i])
        if i == 0 and j == 0:
            break
        how = came[i, j - i + half]
        if how != 2 and j > 0:
            j -= 1
        if how != 1 and i > 0:
            i -= 1
    return distance, size
