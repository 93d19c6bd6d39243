"""The lateral motion of a bogie with yaw dampers: wheelsets on conical wheels, bogie frame, half of a car body.

Coordinates: y and ψ of the front and the rear wheelset and of the frame, and y of the body. Wheel–rail contact: the
creep forces are linear in the creepages (Kalker's coefficients, f_x and f_y in N a wheel), and saturate at friction as
Johnson and Vermeulen have it, as used by Shen, Hedrick & Elkins 1983; spin is left out. A flange is a spring beyond its
clearance. The linear part is stepped exactly; what the contact gives less than the linear creep is taken at the end of
each step from a first guess of the state there (Heun's method, second order).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT
from identification.errors import ModelError
from identification.studies.vehicle.linear import LinearLeap, LinearSteps, LinearVehicle
from identification.studies.vehicle.quarter_car import output

Floats = NDArray[np.float64]

FRONT, REAR = 0, 2  # first coordinate of each wheelset; its yaw is the next
FRAME, BODY = 4, 6
_N = 7
_ABOVE_ZERO = (
    "speed_m_s",
    "wheelset_mass_kg",
    "wheelset_inertia_kg_m2",
    "frame_mass_kg",
    "frame_inertia_kg_m2",
    "half_body_mass_kg",
    "half_wheelbase_m",
    "half_gauge_m",
    "wheel_radius_m",
    "wheel_load_n",
    "friction",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bogie:
    """Parameters, SI. The defaults are a passenger coach of usual size on worn wheels, and no particular vehicle.

    Stiffness of the primary suspension is that of both sides of one wheelset.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    speed_m_s: float = 60.0
    wheelset_mass_kg: float = 1500.0
    wheelset_inertia_kg_m2: float = 900.0  # about the vertical, as all below
    frame_mass_kg: float = 2600.0
    frame_inertia_kg_m2: float = 3000.0
    half_body_mass_kg: float = 15000.0
    half_wheelbase_m: float = 1.25
    half_gauge_m: float = 0.75
    wheel_radius_m: float = 0.46
    conicity: float = 0.15
    primary_lateral_n_per_m: float = 8e6
    primary_yaw_n_m_per_rad: float = 8e6
    secondary_lateral_n_per_m: float = 350e3
    secondary_lateral_damping_n_s_per_m: float = 30e3
    secondary_yaw_n_m_per_rad: float = 300e3
    damper_half_spacing_m: float = 1.3
    creep_longitudinal_n: float = 8e6
    creep_lateral_n: float = 8e6
    wheel_load_n: float = 55e3
    friction: float = 0.35
    flange_clearance_m: float = 0.007
    flange_n_per_m: float = 15e6
    shift_m: float = 0.003  # of the front wheelset at the beginning

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ModelError(f"bogie: {name} is {value:g}: it must be 0 or more")
        for name in _ABOVE_ZERO:
            if getattr(self, name) == 0.0:
                raise ModelError(f"bogie: {name} is 0: it must be above 0")


@dataclass(frozen=True, slots=True)
class RailBogie:
    """A bogie at one speed: a `Vehicle` with a yaw damper on either side, on a rail that may lie astray."""

    given: Bogie

    @property
    def name(self) -> str:
        """With its speed."""
        return f"bogie at {3.6 * self.given.speed_m_s:.4g} km/h"

    @property
    def dampers(self) -> tuple[str, ...]:
        """The yaw dampers; the left one is pulled out where the right one is pushed in."""
        return ("right", "left")

    @property
    def grounds(self) -> tuple[str, ...]:
        """The lateral position of the track below each wheelset."""
        return ("front rail", "rear rail")

    @property
    def outputs(self) -> Mapping[str, str]:
        """The outputs."""
        return linear_bogie(self.given).outputs

    def steps(self, dt: float) -> BogieSteps:
        """The bogie at the step `dt`, s."""
        return BogieSteps(self.given, dt)


def linear_bogie(p: Bogie) -> LinearVehicle:
    """The bogie with linear creep and without flanges; behind its two dampers, places for the four contact forces."""
    creep, creep_rate = _creep(p)
    stiffness, damping = _suspension(p)
    stiffness[:4, :4] += creep
    damping[:4, :4] += creep_rate
    steer = np.zeros((_N, 2))  # the rail moves the contact as the wheelset would
    for axle, first in enumerate((FRONT, REAR)):
        steer[first + 1, axle] = stiffness[first + 1, first] - _primary(p)[0][first + 1, first]
    ends = np.zeros((6, _N))
    ends[0, FRAME + 1], ends[1, FRAME + 1] = p.damper_half_spacing_m, -p.damper_half_spacing_m
    ends[2:, :4] = np.eye(4)
    unit = np.eye(_N)
    rows = {
        "front_wheelset": output("m", q=unit[FRONT].tolist(), dampers=6, grounds=2),
        "rear_wheelset": output("m", q=unit[REAR].tolist(), dampers=6, grounds=2),
        "frame": output("m", q=unit[FRAME].tolist(), dampers=6, grounds=2),
        "frame_yaw": output("rad", q=unit[FRAME + 1].tolist(), dampers=6, grounds=2),
        "frame_acceleration": output("m/s²", acceleration=unit[FRAME].tolist(), dampers=6, grounds=2),
        "body_acceleration": output("m/s²", acceleration=unit[BODY].tolist(), dampers=6, grounds=2),
    }
    return LinearVehicle(
        name=RailBogie(p).name,
        dampers=("right", "left", "front creep", "front spin", "rear creep", "rear spin"),
        grounds=("front rail", "rear rail"),
        mass=np.diag(
            [
                p.wheelset_mass_kg,
                p.wheelset_inertia_kg_m2,
                p.wheelset_mass_kg,
                p.wheelset_inertia_kg_m2,
                p.frame_mass_kg,
                p.frame_inertia_kg_m2,
                p.half_body_mass_kg,
            ]
        ),
        damping=damping,
        stiffness=stiffness,
        ground_stiffness=steer,
        ground_damping=np.zeros((_N, 2)),
        ends=ends,
        ground_ends=np.zeros((6, 2)),
        rows=rows,
        may_grow=True,
    )


def _creep(p: Bogie) -> tuple[Floats, Floats]:
    """Linear creep of both wheelsets by (y, ψ, y, ψ) and by their rates, (4, 4) each."""
    b, r, v = p.half_gauge_m, p.wheel_radius_m, p.speed_m_s
    by_position, by_rate = np.zeros((4, 4)), np.zeros((4, 4))
    for y in (FRONT, REAR):
        psi = y + 1
        by_position[y, psi] = -2.0 * p.creep_lateral_n
        by_position[psi, y] = 2.0 * p.creep_longitudinal_n * b * p.conicity / r
        by_rate[y, y] = 2.0 * p.creep_lateral_n / v
        by_rate[psi, psi] = 2.0 * p.creep_longitudinal_n * b * b / v
    return by_position, by_rate


def _primary(p: Bogie) -> tuple[Floats, Floats]:
    """Stiffness of the primary suspension, (7, 7), and nothing of damping."""
    stiffness = np.zeros((_N, _N))
    for y, ahead in ((FRONT, p.half_wheelbase_m), (REAR, -p.half_wheelbase_m)):
        lateral, yaw = np.zeros(_N), np.zeros(_N)
        lateral[[y, FRAME, FRAME + 1]] = 1.0, -1.0, -ahead
        yaw[[y + 1, FRAME + 1]] = 1.0, -1.0
        stiffness += p.primary_lateral_n_per_m * np.outer(lateral, lateral)
        stiffness += p.primary_yaw_n_m_per_rad * np.outer(yaw, yaw)
    return stiffness, np.zeros((_N, _N))


def _suspension(p: Bogie) -> tuple[Floats, Floats]:
    """Stiffness and damping of both stages, (7, 7) each."""
    stiffness, damping = _primary(p)
    sway = np.zeros(_N)
    sway[[FRAME, BODY]] = 1.0, -1.0
    stiffness += p.secondary_lateral_n_per_m * np.outer(sway, sway)
    damping += p.secondary_lateral_damping_n_s_per_m * np.outer(sway, sway)
    stiffness[FRAME + 1, FRAME + 1] += p.secondary_yaw_n_m_per_rad
    return stiffness, damping


class BogieSteps:
    """The bogie at a fixed step; its state is that of the linear one."""

    def __init__(self, given: Bogie, dt: float) -> None:
        """The matrices of one step of `dt`, s."""
        self._given, self._linear = given, LinearSteps(linear_bogie(given), dt)

    def start(self) -> Floats:
        """At rest but for the shift of the front wheelset."""
        state = self._linear.start()
        state[FRONT] = self._given.shift_m
        return state

    def leap(self, state: Floats, before: Floats, after: Floats, forces: Floats) -> BogieLeap:
        """A step whose damper forces at the end are open."""
        held = np.concatenate([forces, contact(self._given, state, before)])
        linear = self._linear.leap(state, before, after, held)
        return BogieLeap(linear, contact(self._given, linear.state(held), after))

    def motions(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """Motion of both dampers, (2, 3)."""
        return self._linear.motions(state, given, self._whole(state, given, forces))[:2]

    def observe(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """The outputs in a state."""
        return self._linear.observe(state, given, self._whole(state, given, forces))

    def _whole(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        return np.concatenate([forces, contact(self._given, state, given)])


@dataclass(frozen=True, slots=True)
class BogieLeap:
    """The end of a step as a line in the damper forces there, the contact forces being known."""

    linear: LinearLeap
    contact: Floats

    def motions(self, forces: Floats) -> Floats:
        """Motion of both dampers, (2, 3)."""
        return self.linear.motions(np.concatenate([forces, self.contact]))[:2]

    def state(self, forces: Floats) -> Floats:
        """The state."""
        return self.linear.state(np.concatenate([forces, self.contact]))


def contact(p: Bogie, state: Floats, given: Floats) -> Floats:
    """What the contact lacks of linear creep, and the flanges: forces against (y, ψ, y, ψ), (4,), N and N·m."""
    out, rates = np.empty(4), state[_N:]
    for axle, y in enumerate((FRONT, REAR)):
        apart = float(state[y] - given[axle, 0])
        yaw, rate, yaw_rate = float(state[y + 1]), float(rates[y]), float(rates[y + 1])
        along = p.conicity * apart / p.wheel_radius_m + p.half_gauge_m * yaw_rate / p.speed_m_s
        across = rate / p.speed_m_s - yaw
        lost = saturated(p, along, across) - 1.0
        flange = p.flange_n_per_m * (max(apart - p.flange_clearance_m, 0.0) + min(apart + p.flange_clearance_m, 0.0))
        out[y] = 2.0 * p.creep_lateral_n * across * lost + flange
        out[y + 1] = 2.0 * p.creep_longitudinal_n * p.half_gauge_m * along * lost
    return out


def saturated(p: Bogie, along: float, across: float) -> float:
    """Share of the linear creep force that friction allows a wheel, by its longitudinal and lateral creepages.

    T = μN (τ − τ²/3 + τ³/27) up to τ = 3, then μN; τ is the linear resultant over μN.
    """
    tau = math.hypot(p.creep_longitudinal_n * along, p.creep_lateral_n * across) / (p.friction * p.wheel_load_n)
    return 1.0 - tau / 3.0 + tau * tau / 27.0 if tau < 3.0 else 1.0 / tau
