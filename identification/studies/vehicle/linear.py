"""A linear vehicle: masses, springs, dashpots and places for dampers, stepped exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from identification.errors import ModelError

Floats = NDArray[np.float64]

_GROWS = 1e-6  # 1/s: a root with a larger real part grows; below it is a mode without damping, up to rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Output:
    """y = coordinates·(q, q̇, q̈) + ground·(g, ġ, g̈) + force·F: rows of weights, (3, n), (3, G) and (D,)."""

    unit: str
    coordinates: Floats
    ground: Floats
    force: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearVehicle:
    """M q̈ + C q̇ + K q = K_g g + C_g ġ − Lᵀ F, extension of the dampers e = L q − E g.

    mass, damping, stiffness : (n, n), SI; ground_stiffness, ground_damping : (n, G)
    ends : (D, n), L; ground_ends : (D, G), E
    """

    name: str
    dampers: tuple[str, ...]
    grounds: tuple[str, ...]
    mass: Floats
    damping: Floats
    stiffness: Floats
    ground_stiffness: Floats
    ground_damping: Floats
    ends: Floats
    ground_ends: Floats
    rows: Mapping[str, Output]
    may_grow: bool = False  # a motion that grows without dampers is what is studied

    def __post_init__(self) -> None:
        if not np.all(np.linalg.eigvalsh(0.5 * (self.mass + self.mass.T)) > 0.0):
            raise ModelError(f"{self.name}: the mass matrix is not positive: every mass must be above 0 kg")
        growth = self.growth()
        if growth > _GROWS and not self.may_grow:
            raise ModelError(
                f"{self.name} is unstable without its dampers (a mode grows with {growth:.3g} 1/s): "
                "check stiffness and damping"
            )

    @property
    def outputs(self) -> Mapping[str, str]:
        """The outputs, name to unit."""
        return {name: row.unit for name, row in self.rows.items()}

    def growth(self, damping: Floats | None = None) -> float:
        """The fastest growth of a free motion, 1/s, below 0 where all decay; with dashpots (D,), N·s/m, as dampers."""
        a = self._continuous()[0]
        if damping is not None:
            n = self.mass.shape[0]
            a[n:, n:] -= np.linalg.solve(self.mass, (self.ends.T * damping) @ self.ends)
        return float(np.max(np.linalg.eigvals(a).real))

    def steps(self, dt: float) -> LinearSteps:
        """The vehicle at the step `dt`, s."""
        return LinearSteps(self, dt)

    def transfer(self, name: str, frequency_hz: Floats, damping: Floats | None = None) -> NDArray[np.complex128]:
        """Exact frequency response of an output to the first ground's displacement, (K,), with linear dashpots
        `damping` (D,), N·s/m, in the places of the dampers; none where they are not given.
        """
        c = np.zeros(len(self.dampers)) if damping is None else damping
        row, answers = self.rows[name], np.empty(frequency_hz.size, dtype=np.complex128)
        for k, f in enumerate(frequency_hz):
            s = 2j * np.pi * f
            pull = self.ends.T * (c * s)
            dynamic = s * s * self.mass + s * self.damping + self.stiffness + pull @ self.ends
            q = np.linalg.solve(dynamic, self.ground_stiffness + s * self.ground_damping + pull @ self.ground_ends)[
                :, 0
            ]
            force = c * s * (self.ends @ q - self.ground_ends[:, 0])
            powers = np.array([1.0, s, s * s])
            answers[k] = powers @ (row.coordinates @ q + row.ground[:, 0]) + row.force @ force
        return answers

    def _continuous(self) -> tuple[Floats, Floats, Floats]:
        """A, and the inputs by (g, ġ, g̈), (2n, 3G), and by the forces, (2n, D)."""
        n, grounds = self.mass.shape[0], len(self.grounds)
        inverse = np.linalg.inv(self.mass)
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])
        by_ground = np.hstack([self.ground_stiffness, self.ground_damping, np.zeros((n, grounds))])
        b = np.vstack([np.zeros((n, 3 * grounds)), inverse @ by_ground])
        return a, b, np.vstack([np.zeros((n, len(self.dampers))), -inverse @ self.ends.T])


class LinearSteps:
    """Exact for a ground and forces that are linear between samples (first-order hold)."""

    def __init__(self, vehicle: LinearVehicle, dt: float) -> None:
        """The matrices of one step of `dt`, s."""
        a, b, f = vehicle._continuous()
        n, inputs = a.shape[0], np.hstack([b, f])
        m = inputs.shape[1]
        block = np.zeros((n + 2 * m, n + 2 * m))
        block[:n, :n], block[:n, n : n + m] = a * dt, inputs * dt
        block[n : n + m, n + m :] = np.eye(m)
        full = expm(block)
        self._phi, later = full[:n, :n], full[:n, n + m :]
        earlier = full[:n, n : n + m] - later
        grounds = b.shape[1]
        self._before, self._after = earlier[:, :grounds], later[:, :grounds]
        self._force_before, self._force_after = earlier[:, grounds:], later[:, grounds:]
        self._read = _readings(vehicle, a, b, f)
        self._size, self._dampers = n, len(vehicle.dampers)
        by_state, _, by_force = self._read
        moved = 3 * self._dampers
        self._answer = by_state[:moved] @ self._force_after + by_force[:moved]  # of the motions at the end, by a force

    def start(self) -> Floats:
        """At rest."""
        return np.zeros(self._size)

    def leap(self, state: Floats, before: Floats, after: Floats, forces: Floats) -> LinearLeap:
        """A step whose forces at the end are open."""
        given = after.T.ravel()
        base = self._phi @ state + self._before @ before.T.ravel() + self._after @ given + self._force_before @ forces
        moved = 3 * self._dampers
        motions = self._read[0][:moved] @ base + self._read[1][:moved] @ given
        return LinearLeap(base, self._force_after, motions, self._answer)

    def motions(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """Motion of every damper in a state, (D, 3)."""
        return self._all(state, given, forces)[: 3 * self._dampers].reshape(3, -1).T

    def observe(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        """The outputs in a state."""
        return self._all(state, given, forces)[3 * self._dampers :]

    def _all(self, state: Floats, given: Floats, forces: Floats) -> Floats:
        by_state, by_ground, by_force = self._read
        return np.asarray(by_state @ state + by_ground @ given.T.ravel() + by_force @ forces)


class LinearLeap:
    """The end of a step as a line in the forces there."""

    def __init__(self, base: Floats, by_force: Floats, motions: Floats, answer: Floats) -> None:
        """State and motions without a force at the end, and what a force adds to each."""
        self._base, self._by_force, self._motions, self._answer = base, by_force, motions, answer

    def motions(self, forces: Floats) -> Floats:
        """Motion of every damper, (D, 3)."""
        return (self._motions + self._answer @ forces).reshape(3, -1).T

    def state(self, forces: Floats) -> Floats:
        """The state."""
        return np.asarray(self._base + self._by_force @ forces)


def _readings(vehicle: LinearVehicle, a: Floats, b: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
    """Matrices that read the dampers' x, v and a, and then the outputs, from state, ground and forces."""
    n, grounds, dampers = vehicle.mass.shape[0], len(vehicle.grounds), len(vehicle.dampers)
    eye, zero = np.eye(n), np.zeros((n, n))
    to_q = [np.hstack([eye, zero]), np.hstack([zero, eye]), a[n:]]  # q, q̇ and q̈ from the state
    to_q_ground = [np.zeros((n, 3 * grounds)), np.zeros((n, 3 * grounds)), b[n:]]
    to_q_force = [np.zeros((n, dampers)), np.zeros((n, dampers)), f[n:]]
    by_state, by_ground, by_force = [], [], []
    for order in range(3):
        own = np.zeros((dampers, 3 * grounds))
        own[:, order * grounds : (order + 1) * grounds] = -vehicle.ground_ends
        by_state.append(vehicle.ends @ to_q[order])
        by_ground.append(vehicle.ends @ to_q_ground[order] + own)
        by_force.append(vehicle.ends @ to_q_force[order])
    for row in vehicle.rows.values():
        weights = row.coordinates.reshape(1, -1)
        by_state.append(weights @ np.vstack(to_q))
        by_ground.append(weights @ np.vstack(to_q_ground) + row.ground.reshape(1, -1))
        by_force.append(weights @ np.vstack(to_q_force) + row.force[None, :])
    return np.vstack(by_state), np.vstack(by_ground), np.vstack(by_force)
