"""What the piston does under an excitation: displacement, velocity, acceleration, current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.periodic import derivative
from excitation.signal import Excitation

__all__ = ["BAND_LIMITED", "Motion", "motion"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """One period, or the whole of what is not periodic; arrays (N,)."""

    sample_rate_hz: float
    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    acceleration_m_s2: NDArray[np.float64]
    current_a: NDArray[np.float64] | None
    repeats: float  # how many times these samples are played


def motion(excitation: Excitation) -> Motion:
    """Displacement with its derivatives.

    Exact by DFT where the signal is band-limited and is periodic (multisines, sines, steps under a
    sine); differences between samples where it is not (triangles, foreign signals).
    """
    played = excitation.period_samples or excitation.samples
    displacement = excitation.displacement_m[-played:]
    velocity, acceleration = _derivatives(excitation, displacement)
    return Motion(
        sample_rate_hz=excitation.sample_rate_hz,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=acceleration,
        current_a=None if excitation.current_a is None else excitation.current_a[-played:],
        repeats=excitation.samples / played,
    )


BAND_LIMITED = (Kind.MULTISINE, Kind.SINE, Kind.STEPS)


def _derivatives(
    excitation: Excitation, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rate = excitation.sample_rate_hz
    if excitation.kind in BAND_LIMITED:
        velocity = derivative(displacement, rate)
        return velocity, derivative(velocity, rate)
    if excitation.period_samples:
        ahead, behind = np.roll(displacement, -1), np.roll(displacement, 1)
        velocity = np.where(
            np.abs(ahead - displacement) > np.abs(displacement - behind),
            ahead - displacement,
            displacement - behind,
        )
        return velocity * rate, (ahead - 2.0 * displacement + behind) * rate**2
    if displacement.size < 3:
        return np.zeros_like(displacement), np.zeros_like(displacement)
    velocity = np.gradient(displacement, 1.0 / rate)
    return velocity, np.gradient(velocity, 1.0 / rate)
