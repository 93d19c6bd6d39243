"""What is limited or covered of a motion: displacement, its derivatives, force, as commanded and at the damper."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excitation.multisine_spec import MultisineSpec
from excitation.periodic import Multitone
from excitation.portable_math import angle_turns
from excitation.response import gains

__all__ = ["Quantity", "at_damper", "current_behind_rig", "motion_quantities"]

_ORDERS = ("displacement", "velocity", "acceleration")
_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²", "force": "N"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Quantity:
    """A linear function of the commanded displacement: gain and phase of each of its lines."""

    variable: str  # displacement, velocity, acceleration or force
    at_damper: bool  # behind the rig's response
    limit: float | None
    gain: NDArray[np.float64]  # (K,)
    turns: NDArray[np.float64]  # (K,)

    @property
    def name(self) -> str:
        return f"{self.variable}_at_damper" if self.at_damper and self.variable != "force" else self.variable

    @property
    def unit(self) -> str:
        return _UNITS[self.variable]

    def is_received(self, spec: MultisineSpec) -> bool:
        """Whether it is what the damper gets: behind the rig, or commanded where the rig follows exactly."""
        return self.at_damper or spec.response is None or spec.response.displacement is None

    def tones(self, motion: Multitone) -> Multitone:
        """The quantity while the commanded displacement is ``motion``."""
        turned = motion.phase_turns + self.turns
        return replace(motion, amplitude=motion.amplitude * self.gain, phase_turns=turned - np.floor(turned))

    def rms(self, motion: Multitone) -> float:
        amplitude = motion.amplitude * self.gain
        return float(np.sqrt(0.5 * np.sum(amplitude * amplitude)))


def motion_quantities(spec: MultisineSpec, motion: Multitone) -> tuple[Quantity, ...]:
    """Displacement, velocity and acceleration as commanded, the same at the damper where the rig's response is known,
    and the force where an estimate of it is given.

    Raises DesignError where the response does not span the lines.
    """
    asked = spec.displacement
    omega = motion.omega(spec.sample_rate_hz)
    one = np.ones_like(omega)
    limits = (asked.max_displacement_m, asked.max_velocity_m_s, asked.max_acceleration_m_s2)
    made = [
        Quantity(variable=name, at_damper=False, limit=limit, gain=gain, turns=0.25 * order * one)
        for order, (name, limit, gain) in enumerate(zip(_ORDERS, limits, (one, omega, omega * omega), strict=True))
    ]
    known = None if spec.response is None else spec.response.displacement
    if known is not None:
        gain, turns = gains(known, motion.lines.astype(np.float64) * (spec.sample_rate_hz / spec.period_samples))
        made += [replace(q, at_damper=True, gain=q.gain * gain, turns=q.turns + turns) for q in made]
    if spec.force is not None:
        made.append(_force(spec, made[-3], omega))
    return tuple(made)


def _force(spec: MultisineSpec, displacement: Quantity, omega: NDArray[np.float64]) -> Quantity:
    """(k − ω²m + jω(c + c_i·i_max))·X, its friction taken off the limit."""
    force = spec.force
    assert force is not None
    current = 0.0 if spec.current is None else max(abs(spec.current.min_a), abs(spec.current.max_a))
    real = force.stiffness_n_m - force.mass_kg * omega * omega
    imaginary = (force.damping_n_s_m + force.damping_control * current) * omega
    # displacement is the first of the three quantities at the damper
    return Quantity(
        variable="force",
        at_damper=True,
        limit=force.max_n - force.friction_n,
        gain=np.sqrt(real * real + imaginary * imaginary) * displacement.gain,
        turns=angle_turns(real, imaginary) + displacement.turns,
    )


def at_damper(spec: MultisineSpec, quantities: tuple[Quantity, ...], variable: str) -> Quantity:
    """The quantity of a variable that the damper gets."""
    return next(q for q in quantities if q.variable == variable and q.is_received(spec))


def current_behind_rig(spec: MultisineSpec, current: Multitone) -> Multitone:
    """The current that the damper gets, without its mean. Raises DesignError as ``motion_quantities``."""
    known = None if spec.response is None else spec.response.current
    if known is None:
        return current
    gain, turns = gains(known, current.lines.astype(np.float64) * (spec.sample_rate_hz / spec.period_samples))
    turned = current.phase_turns + turns
    return replace(current, amplitude=current.amplitude * gain, phase_turns=turned - np.floor(turned))
