"""What a vehicle is to a study: places for dampers, a ground that moves, and outputs with names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ground:
    """What moves a vehicle, sample by sample: height of each ground and its derivatives, (N, G), m, m/s and m/s²."""

    dt: float
    x: Floats
    v: Floats
    a: Floats

    def __post_init__(self) -> None:
        if not (np.isfinite(self.dt) and self.dt > 0.0):
            raise DataError(f"the step of the ground is {self.dt:g} s: it must be above 0")
        for name in ("x", "v", "a"):
            series = getattr(self, name)
            if series.ndim != 2 or series.shape != self.x.shape or series.shape[0] < 2:
                raise DataError(
                    f"ground.{name} has the shape {series.shape}: it must be (samples, grounds), 2 at least"
                )
            if not np.all(np.isfinite(series)):
                raise DataError(f"ground.{name} is not finite at sample {np.argmin(np.isfinite(series).all(axis=1))}")

    @property
    def time(self) -> Floats:
        """(N,), s."""
        return np.asarray(np.arange(self.x.shape[0]) * self.dt, dtype=np.float64)


class Leap(Protocol):
    """One step of a vehicle whose damper forces at its end are still open; forces (D,), N, tension positive."""

    def motions(self, forces: Floats) -> Floats:
        """Extension of every damper at the end of the step, its velocity and acceleration, (D, 3), SI."""
        ...

    def state(self, forces: Floats) -> Floats:
        """The state of the vehicle at the end of the step."""
        ...


class VehicleSteps(Protocol):
    """A vehicle at a fixed step. `given` is (G, 3): the ground's displacement, velocity and acceleration."""

    def start(self) -> Floats:
        """The state at the beginning."""
        ...

    def leap(self, state: Floats, before: Floats, after: Floats, forces: Floats) -> Leap:
        """A step from the ground `before` to the ground `after`, from the damper forces (D,) at its beginning."""
        ...

    def motions(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """Motion of every damper in a state, (D, 3)."""
        ...

    def observe(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """The outputs in a state, in the order of their names."""
        ...


class Vehicle(Protocol):
    """A vehicle without its dampers."""

    @property
    def name(self) -> str:
        """What it is."""
        ...

    @property
    def dampers(self) -> tuple[str, ...]:
        """The places for dampers, D of them."""
        ...

    @property
    def grounds(self) -> tuple[str, ...]:
        """What moves it, G of them."""
        ...

    @property
    def outputs(self) -> Mapping[str, str]:
        """The outputs, name to unit."""
        ...

    def steps(self, dt: float) -> VehicleSteps:
        """The vehicle at the step `dt`, s; raises SimulationError where it cannot be taken so."""
        ...
