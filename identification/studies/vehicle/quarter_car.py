"""The linear quarter car: a body on a suspension spring and a damper, a wheel on its tyre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from excitation.configuration import STRICT
from identification.errors import ModelError
from identification.studies.vehicle.linear import LinearVehicle, Output


@dataclass(frozen=True, slots=True, kw_only=True)
class QuarterCar:
    """Parameters, SI; the defaults are a quarter of a passenger car.

    Source of the defaults: Dixon, The Shock Absorber Handbook, 2nd ed., 2007, in the middle of the ranges of a car:
    body 1.2 Hz, wheel 11 Hz.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    body_mass_kg: float = 300.0
    wheel_mass_kg: float = 40.0
    spring_n_per_m: float = 17e3
    tyre_n_per_m: float = 180e3
    tyre_damping_n_s_per_m: float = 100.0

    def __post_init__(self) -> None:
        for name in ("body_mass_kg", "wheel_mass_kg", "spring_n_per_m", "tyre_n_per_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ModelError(f"quarter car: {name} is {value:g}: it must be above 0")
        if not 0.0 <= self.tyre_damping_n_s_per_m < np.inf:
            raise ModelError(f"quarter car: tyre_damping_n_s_per_m is {self.tyre_damping_n_s_per_m:g}: 0 or more")


def quarter_car(given: QuarterCar | None = None) -> LinearVehicle:
    """m_b z̈_b = −k (z_b − z_w) − F, m_w z̈_w = k (z_b − z_w) + F − k_t (z_w − g) − c_t (ż_w − ġ).

    Outputs: `body` and `wheel`, m; `body_acceleration`, m/s²; `tyre_force`, N, about the static load.
    """
    p = given or QuarterCar()
    k, k_t, c_t = p.spring_n_per_m, p.tyre_n_per_m, p.tyre_damping_n_s_per_m
    return LinearVehicle(
        name="quarter car",
        dampers=("suspension",),
        grounds=("road",),
        mass=np.diag([p.body_mass_kg, p.wheel_mass_kg]),
        damping=np.diag([0.0, c_t]),
        stiffness=np.array([[k, -k], [-k, k + k_t]]),
        ground_stiffness=np.array([[0.0], [k_t]]),
        ground_damping=np.array([[0.0], [c_t]]),
        ends=np.array([[1.0, -1.0]]),
        ground_ends=np.zeros((1, 1)),
        rows={
            "body": output("m", q=[1.0, 0.0]),
            "wheel": output("m", q=[0.0, 1.0]),
            "body_acceleration": output("m/s²", acceleration=[1.0, 0.0]),
            "tyre_force": output("N", q=[0.0, -k_t], velocity=[0.0, -c_t], ground=[k_t, c_t, 0.0]),
        },
    )


def output(
    unit: str,
    *,
    q: list[float] | None = None,
    velocity: list[float] | None = None,
    acceleration: list[float] | None = None,
    ground: list[float] | None = None,
    dampers: int = 1,
    grounds: int = 1,
) -> Output:
    """An output of a vehicle on one ground: weights of its coordinates, their derivatives, and of (g, ġ, g̈)."""
    rows = (q, velocity, acceleration)
    size = max(len(row) for row in rows if row is not None) if any(row is not None for row in rows) else 0
    coordinates = np.array([row if row is not None else [0.0] * size for row in rows])
    own = np.zeros((3, grounds)) if ground is None else np.array(ground)[:, None]
    return Output(unit=unit, coordinates=coordinates, ground=own, force=np.zeros(dampers))
