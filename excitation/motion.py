"""What the piston does under an excitation: displacement, velocity, acceleration, current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.periodic import derivative
from excitation.signal import Excitation

__all__ = ["BAND_LIMITED", "Motion", "derivatives", "motion"]


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

    Exact by DFT where the signal is band-limited and is periodic (multisines, sines, steps under a sine, roads) or
    begins and ends at rest (sweeps, faded records); differences between samples elsewhere (triangles, foreign signals).
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


def _is_smooth(excitation: Excitation, displacement: NDArray[np.float64]) -> bool:
    """Whether the DFT differentiates it: its end goes over into its beginning without a step or a bend."""
    match excitation.kind:
        case Kind.TRIANGLE:
            return False
        case Kind.ROAD:
            return bool(excitation.period_samples) or _rests(displacement)
        case Kind.SWEEP | Kind.CUSTOM:
            return not excitation.period_samples and _rests(displacement)
    return True


def _rests(displacement: NDArray[np.float64]) -> bool:
    """Whether it begins and ends in one place, without speed to speak of."""
    ends = np.concatenate([displacement[-2:], displacement[:2]])
    return displacement.size >= 16 and bool(np.ptp(ends) <= 1e-4 * np.ptp(displacement))


BAND_LIMITED = (Kind.MULTISINE, Kind.SINE, Kind.STEPS)


def derivatives(excitation: Excitation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity, m/s, and acceleration, m/s², of every sample, (N,) each: those of the last period in each period."""
    moved = motion(excitation)
    played = moved.velocity_m_s.size
    turn = excitation.samples % played  # the last period ends with the last sample
    velocity, acceleration = (np.roll(one, turn) for one in (moved.velocity_m_s, moved.acceleration_m_s2))
    return np.resize(velocity, excitation.samples), np.resize(acceleration, excitation.samples)


def _derivatives(
    excitation: Excitation, displacement: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rate = excitation.sample_rate_hz
    if _is_smooth(excitation, displacement):
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
