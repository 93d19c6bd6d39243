"""Drive-file iteration: the drive that makes the measured channels equal the wanted ones. Pure: no rig, no file.

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
from rigctl.response import Response

ENERGY = 1.0 - 1e-7  # share of a target's energy below the bandwidth, where none is given
ROLL = 0.25  # the correction ends above the bandwidth within this share of it


@dataclass(frozen=True, slots=True, kw_only=True)
class IterationSettings:
    """Step size, bandwidth and end of the iteration."""

    gain: float = 1.0  # share of the correction that one step makes; an uncertain response is in the correction
    bandwidth_hz: float | None = None  # no correction above; None: where the energy of a channel's target ends
    regularisation: float = 0.05  # where the response is smaller than this, the inverse is small too
    tolerance: float = 0.01  # rms of the error over rms of the target, for every channel
    most: int = 5  # iterations after the first round
    motion_only: bool = False  # the current is played as commanded

    def __post_init__(self) -> None:
        for name, low, high in (("gain", 0.0, 1.5), ("regularisation", 0.0, 1.0), ("tolerance", 0.0, 1.0)):
            value = getattr(self, name)
            if not (isfinite(value) and low < value <= high):
                raise IterationError(f"{name} is {value}: it must lie above {low:g} and not above {high:g}")
        if self.bandwidth_hz is not None and not (isfinite(self.bandwidth_hz) and self.bandwidth_hz > 0):
            raise IterationError(f"bandwidth is {self.bandwidth_hz} Hz: it must be positive")
        if self.most < 1:
            raise IterationError(f"iterations is {self.most}: it must be 1 or more")


def roll_off(frequency_hz: NDArray[np.float64], bandwidth_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 up to each channel's bandwidth, then a cosine to 0 at 1.25 times it; (K, C) of (K,) and (C,)."""
    past = np.clip((frequency_hz[:, None] / bandwidth_hz - 1.0) / ROLL, 0.0, 1.0)
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * past)), dtype=np.float64)


def correction(
    response: Response, error: NDArray[np.complex128], regularisation: float, roll: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Step of the drive that leaves the smallest expected error, (K, C), relative channels.

    Minimises E|e − (H + δH)·s|² + λ²|s|²: s = Q·(Hᴴ·H + E[δHᴴ·δH] + λ²)⁻¹·Hᴴ·e. A line whose response is uncertain
    is corrected less, one whose response was not seen not at all. λ: the regularisation, Q: the roll-off.
    """
    adjoint = np.conj(np.swapaxes(response.gain, 1, 2))
    normal = adjoint @ response.gain + response.variance + regularisation**2 * np.eye(error.shape[1])
    step = np.linalg.solve(normal, adjoint @ error[..., None])[..., 0]
    return np.asarray(roll * step, dtype=np.complex128)


def relative_error(measured: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Rms of measured − target over rms of the target about its mean."""
    return float(np.sqrt(np.mean((measured - target) ** 2)) / np.std(target))


def natural_bandwidth_hz(target: NDArray[np.float64], sample_rate_hz: float) -> float:
    """Frequency below which the share ENERGY of a target's energy lies, Hz."""
    window = np.hanning(target.size)
    power = np.abs(np.fft.rfft((target - target.mean()) * window)) ** 2
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    frequency = np.fft.rfftfreq(target.size, 1 / sample_rate_hz)
    return float(frequency[int(np.searchsorted(share, ENERGY))])
