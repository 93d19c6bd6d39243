"""A vehicle of the user's own: Python functions for its motion, stepped by the classical Runge–Kutta method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.errors import ModelError, SimulationError

Floats = NDArray[np.float64]
Function = Callable[[Floats, Floats, Floats], ArrayLike]
"""(state (S,), ground (G, 3) of displacement, velocity and acceleration, forces (D,), N) to something."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnVehicle:
    """ds/dt = derivative(s, g, F) with the dampers' motion and the outputs as functions too.

    derivative : the rate of the state, (S,); a force above 0 pulls the ends of its damper together
    motion : extension and its rate of every damper, (D, 2), m and m/s; its acceleration is the slope of the rate
    observe : the outputs in the order of their names
    """

    name: str
    dampers: tuple[str, ...]
    grounds: tuple[str, ...]
    outputs: Mapping[str, str]
    begin: tuple[float, ...]
    derivative: Function
    motion: Function
    observe: Function

    def __post_init__(self) -> None:
        ground, forces = np.zeros((len(self.grounds), 3)), np.zeros(len(self.dampers))
        state = np.array(self.begin)
        wanted = {
            "derivative": (self.derivative, (len(self.begin),)),
            "motion": (self.motion, (len(self.dampers), 2)),
            "observe": (self.observe, (len(self.outputs),)),
        }
        for name, (function, shape) in wanted.items():
            found = np.shape(function(state, ground, forces))
            if found != shape:
                raise ModelError(f"{self.name}: {name} gives the shape {found}: it must be {shape}")

    def steps(self, dt: float) -> OwnSteps:
        """The vehicle at the step `dt`, s."""
        return OwnSteps(self, dt)


@dataclass(frozen=True, slots=True)
class OwnSteps:
    """The vehicle at a fixed step; ground and forces are linear between samples."""

    vehicle: OwnVehicle
    dt: float

    def start(self) -> Floats:
        """The state at the beginning."""
        return np.array(self.vehicle.begin, dtype=np.float64)

    def leap(self, state: Floats, before: Floats, after: Floats, forces: Floats) -> OwnLeap:
        """A step whose forces at the end are open."""
        return OwnLeap(self, state, before, after, forces)

    def motions(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """Motion of every damper, (D, 3); the acceleration is the slope of the rate along the motion."""
        vehicle, tiny = self.vehicle, 1e-3 * self.dt
        now = np.asarray(vehicle.motion(state, given, forces), dtype=np.float64)
        rate = np.asarray(vehicle.derivative(state, given, forces), dtype=np.float64)
        moved = np.column_stack([given[:, 0] + tiny * given[:, 1], given[:, 1] + tiny * given[:, 2], given[:, 2]])
        soon = np.asarray(vehicle.motion(state + tiny * rate, moved, forces), dtype=np.float64)
        return np.column_stack([now, (soon[:, 1] - now[:, 1]) / tiny])

    def observe(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """The outputs in a state; raises SimulationError where one is not finite."""
        found = np.asarray(self.vehicle.observe(state, given, forces), dtype=np.float64)
        if not np.all(np.isfinite(found)):
            name = list(self.vehicle.outputs)[int(np.argmin(np.isfinite(found)))]
            raise SimulationError(f"{self.vehicle.name}: the output {name} is not finite")
        return found


@dataclass(frozen=True, slots=True)
class OwnLeap:
    """The end of a step, computed anew for every trial of the forces there."""

    steps: OwnSteps
    begin: Floats
    before: Floats
    after: Floats
    forces: Floats

    def state(self, forces: Floats) -> Floats:
        """The state at the end with these forces there."""
        dt, s = self.steps.dt, self.begin
        middle, pull = 0.5 * (self.before + self.after), 0.5 * (self.forces + forces)
        k1 = self._rate(s, self.before, self.forces)
        k2 = self._rate(s + 0.5 * dt * k1, middle, pull)
        k3 = self._rate(s + 0.5 * dt * k2, middle, pull)
        k4 = self._rate(s + dt * k3, self.after, forces)
        return np.asarray(s + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))

    def motions(self, forces: Floats) -> Floats:
        """Motion of every damper at the end, (D, 3)."""
        return self.steps.motions(self.state(forces), self.after, forces)

    def _rate(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        return np.asarray(self.steps.vehicle.derivative(state, given, forces), dtype=np.float64)
