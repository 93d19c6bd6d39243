"""A damper between two rubber bushes on a rig of six axes: forces and torques of a relative motion of its ends.

The motion of one end against the other is (x, y, z, rx, ry, rz): x along the damper at rest, m and rad. The oil is in
series with the axial stiffness of the bushes; y and z turn the damper, so that they stretch it and its force has parts
along them; the lateral force presses on the rod's guide, whose friction adds to the force of the oil.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

AXES = ("x", "y", "z", "rx", "ry", "rz")
_FINE = 20  # steps within a sample: the oil behind the bush settles within 10 ms


@dataclass(frozen=True, slots=True, kw_only=True)
class Rubber:
    """A bush in one direction: spring that hardens, viscous part, and friction that builds up over a travel."""

    k: float  # N/m or N·m/rad
    hardening: float  # share of k at one unit of travel squared, 1/m² or 1/rad²
    c: float  # N·s/m or N·m·s/rad
    friction: float  # N or N·m
    travel: float  # m or rad over which the friction builds up

    def force(self, travelled: float, speed: float, bent: float) -> float:
        """Force of a travel, its speed and the share of the friction that has built up."""
        spring = self.k * travelled * (1.0 + self.hardening * travelled * travelled)
        return spring + self.c * speed + self.friction * bent

    def bend(self, speed: float, bent: float, dt: float) -> float:
        """The share of the friction after a step."""
        return min(max(bent + dt * (speed - abs(speed) * bent) / self.travel, -1.0), 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiAxisSpecimen:
    """A damper of oil between bushes; `axial` is in series with the oil, the others hold the ends."""

    name: str
    length_m: float
    c_low: float  # N·s/m, of small forces
    relief_n: float  # force at which the valves have opened
    relief_m_s: float  # speed that they add there; it rises with the third power of the force
    guide: float  # friction of the rod's guide, N per N of lateral force
    axial: Rubber
    lateral: Rubber
    torsion: Rubber
    cardanic: Rubber
    lever_m: float  # of the lateral force about the middle of a bush


ANTI_YAW = MultiAxisSpecimen(
    name="anti-yaw, six axes",
    length_m=0.7,
    c_low=2.3e6,
    relief_n=7.6e3,
    relief_m_s=0.006,
    guide=0.35,
    axial=Rubber(k=2.5e6, hardening=2e4, c=0.0, friction=0.0, travel=1e-3),
    lateral=Rubber(k=2.2e5, hardening=400.0, c=1.5e3, friction=150.0, travel=1e-3),
    torsion=Rubber(k=300.0, hardening=4.0, c=2.0, friction=3.0, travel=0.01),
    cardanic=Rubber(k=450.0, hardening=6.0, c=3.0, friction=4.0, travel=0.01),
    lever_m=0.04,
)


def played(
    specimen: MultiAxisSpecimen, motion: Floats, rate_hz: float, *, noise: float = 0.002, seed: int = 0
) -> Floats:
    """Forces, N, and torques, N·m, of a motion (N, 6), as the load cell of six axes reads them, (N, 6).

    `noise` is its share of the rms of each; between two samples the motion is straight.
    """
    dt = 1.0 / (rate_hz * _FINE)
    fine = np.arange(motion.shape[0] * _FINE - _FINE + 1) / _FINE
    path = np.column_stack([np.interp(fine, np.arange(motion.shape[0]), motion[:, k]) for k in range(6)])
    speed = np.gradient(path, dt, axis=0)
    out = np.empty_like(motion)
    oil, bent = 0.0, [0.0] * 6
    for t, (d, v) in enumerate(zip(path.tolist(), speed.tolist(), strict=True)):
        oil, loads = step(specimen, d, v, oil, bent, dt)
        if t % _FINE == 0:
            out[t // _FINE] = loads
    rng = np.random.default_rng(seed)
    return np.asarray(out + noise * np.sqrt(np.mean(out**2, axis=0)) * rng.standard_normal(out.shape))


def step(
    specimen: MultiAxisSpecimen, d: list[float], v: list[float], oil: float, bent: list[float], dt: float
) -> tuple[float, list[float]]:
    """The place of the oil's piston after a step, m, and the six loads; `bent` is carried on in place."""
    lateral, cardanic = specimen.lateral, specimen.cardanic
    kinds = (lateral, lateral, specimen.torsion, cardanic, cardanic)
    for k, rubber in enumerate(kinds, start=1):
        bent[k] = rubber.bend(v[k], bent[k], dt)
    held = [rubber.force(d[k], v[k], bent[k]) for k, rubber in enumerate(kinds, start=1)]
    along = specimen.length_m + d[0]
    length = math.sqrt(along * along + d[1] * d[1] + d[2] * d[2])
    force = specimen.axial.force(length - specimen.length_m - oil, 0.0, 0.0)
    pressed = specimen.guide * math.hypot(held[0], held[1])
    oil_speed = _speed_of(specimen, force, pressed)
    f_x, f_y, f_z = (force * part / length for part in (along, d[1], d[2]))
    f_y, f_z = f_y + held[0], f_z + held[1]
    loads = [f_x, f_y, f_z, held[2], held[3] - specimen.lever_m * f_z, held[4] + specimen.lever_m * f_y]
    return oil + dt * oil_speed, loads


def _speed_of(specimen: MultiAxisSpecimen, force: float, pressed: float) -> float:
    """The speed of the piston under a force, m/s, that first overcomes the friction of its guide."""
    left = max(abs(force) - pressed, 0.0)
    return math.copysign(left / specimen.c_low + specimen.relief_m_s * (left / specimen.relief_n) ** 3, force)
