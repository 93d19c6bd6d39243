"""The seat suspension of two degrees of freedom: a passenger on a cushion, a seat on its spring and damper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from excitation.configuration import STRICT
from identification.errors import ModelError
from identification.studies.vehicle.linear import LinearVehicle
from identification.studies.vehicle.quarter_car import output


@dataclass(frozen=True, slots=True, kw_only=True)
class Seat:
    """Parameters, SI. The defaults are Table 5 of Zhang, Shi & Chen 2021."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    passenger_mass_kg: float = 50.0
    seat_mass_kg: float = 17.0
    cushion_stiffness_n_per_m: float = 19556.0
    cushion_damping_n_s_per_m: float = 1865.0
    suspension_stiffness_n_per_m: float = 78000.0

    def __post_init__(self) -> None:
        for name in ("passenger_mass_kg", "seat_mass_kg", "cushion_stiffness_n_per_m", "suspension_stiffness_n_per_m"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ModelError(f"seat: {name} is {value:g}: it must be above 0")
        if not 0.0 <= self.cushion_damping_n_s_per_m < np.inf:
            raise ModelError(f"seat: cushion_damping_n_s_per_m is {self.cushion_damping_n_s_per_m:g}: 0 or more")


PASSIVE_N_S_PER_M = 942.0
"""The passive damper of the same table."""


def seat_suspension(given: Seat | None = None) -> LinearVehicle:
    """M_p z̈_p = −k_p (z_p − z_s) − c_p (ż_p − ż_s), M_s z̈_s = k_p (z_p − z_s) + c_p (ż_p − ż_s) − k_s (z_s − z_0) − F.

    Outputs: `passenger` and `seat`, m; `seat_velocity`, m/s; `passenger_acceleration` and `seat_acceleration`, m/s².

    References
    ----------
    Zhang, Shi & Chen 2021, Shock and Vibration, 6691650, equation 18.
    """
    p = given or Seat()
    k, c, k_s = p.cushion_stiffness_n_per_m, p.cushion_damping_n_s_per_m, p.suspension_stiffness_n_per_m
    return LinearVehicle(
        name="seat suspension",
        dampers=("suspension",),
        grounds=("floor",),
        mass=np.diag([p.passenger_mass_kg, p.seat_mass_kg]),
        damping=np.array([[c, -c], [-c, c]]),
        stiffness=np.array([[k, -k], [-k, k + k_s]]),
        ground_stiffness=np.array([[0.0], [k_s]]),
        ground_damping=np.zeros((2, 1)),
        ends=np.array([[0.0, 1.0]]),
        ground_ends=np.array([[1.0]]),
        rows={
            "passenger": output("m", q=[1.0, 0.0]),
            "seat": output("m", q=[0.0, 1.0]),
            "seat_velocity": output("m/s", velocity=[0.0, 1.0]),
            "passenger_acceleration": output("m/s²", acceleration=[1.0, 0.0]),
            "seat_acceleration": output("m/s²", acceleration=[0.0, 1.0]),
        },
    )
