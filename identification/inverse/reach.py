"""What a damper can give along a motion: its force at every held current within the limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError, ModelError
from identification.inverse.wanted import Wanted
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]

# Held currents over the range, between which the force is taken as straight. What that misses is corrected by the
# simulation that follows, so half and double change only the number of corrections.
LEVELS = 17

# Share of the rms force by which a wanted force may lie beyond the reach and yet counts as made: what a forward model
# of a fit of 95 % misses anyway. Half: noise of a measured force counts; double: a lack of a tenth is not named.
TOLERANCE = 0.05

# Share of the rms force that the whole range of the current must change it by at least: less is no control.
_LEAST_CONTROL = 0.01

# A, of either limit: as of every input of a model, what is larger is none of a machine.
_LARGEST = 1e6


@dataclass(frozen=True, slots=True)
class Limits:
    """Lowest and highest current, A."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise ModelError(
                f"limits of the current are [{self.low:g}, {self.high:g}] A: give two finite numbers, the lower first"
            )
        if max(-self.low, self.high) > _LARGEST:
            raise ModelError(
                f"limits of the current are [{self.low:g}, {self.high:g}] A: give them within ±{_LARGEST:g} A"
            )

    @property
    def span(self) -> float:
        """Highest less lowest, A."""
        return self.high - self.low

    def levels(self, count: int = LEVELS) -> Floats:
        """Currents from the lowest to the highest, (count,), A."""
        return np.linspace(self.low, self.high, count)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """The force at K held currents, (K, N), N, and its size, the rms about its mean over all of them, N."""

    levels: Floats  # (K,), A
    forces: Floats
    size: float

    @property
    def span(self) -> Floats:
        """Highest less lowest force of each sample, (N,), N."""
        return np.asarray(self.forces.max(axis=0) - self.forces.min(axis=0))

    def lack(self, wanted: Floats) -> Floats:
        """By how much a wanted force (N,) lies above what can be given, N; below it: less than 0; else 0."""
        above = np.maximum(wanted - self.forces.max(axis=0), 0.0)
        return np.asarray(above - np.maximum(self.forces.min(axis=0) - wanted, 0.0))

    def cannot(self, wanted: Floats) -> NDArray[np.bool_]:
        """Samples whose wanted force the damper cannot make, (N,)."""
        return np.abs(self.lack(wanted)) > TOLERANCE * self.size

    def at(self, current: Floats) -> Floats:
        """The force of a current (N,) by straight lines between the levels, (N,), N."""
        place = np.clip((current - self.levels[0]) / (self.levels[1] - self.levels[0]), 0.0, self.levels.size - 1.0)
        below = np.minimum(place.astype(np.int64), self.levels.size - 2)
        share, every = place - below, np.arange(current.size)
        return np.asarray((1.0 - share) * self.forces[below, every] + share * self.forces[below + 1, every])


def reach_of(forward: SimulationModel, wanted: Wanted, limits: Limits, levels: int = LEVELS) -> Reach:
    """The reach of a forward model along a motion, each current held from before its start.

    Raises
    ------
    DataError
        one line, where the model has no current among its inputs, or the current hardly changes its force.
    SimulationError
        as the model does.
    """
    check_controlled(forward)
    currents = limits.levels(levels)
    forces = np.array([forward.force(wanted.driven(current)) for current in currents])
    size = float(np.std(forces))
    found = Reach(levels=currents, forces=forces, size=size)
    if not np.max(found.span) > _LEAST_CONTROL * size:
        raise DataError(
            f"the current hardly changes the force of '{forward.name}' along {wanted.name}: by "
            f"{float(np.max(found.span)):.3g} N of {size:.3g} N rms within [{limits.low:g}, {limits.high:g}] A"
        )
    return found


def check_controlled(forward: SimulationModel) -> None:
    """Raise DataError, one line, where a model has no current to find."""
    if "current" not in forward.inputs:
        raise DataError(f"'{forward.name}' has no current among its inputs: it cannot be inverted; give one that has")


def check_reached(reach: Reach, wanted: Wanted, limits: Limits) -> None:
    """Raise DataError, one line, where no sample of the wanted force can be made."""
    cannot = reach.cannot(wanted.force)
    if not cannot.all():
        return
    lack = np.abs(reach.lack(wanted.force))
    raise DataError(
        f"{wanted.name}: no sample of the wanted force can be made within [{limits.low:g}, {limits.high:g}] A: "
        f"{lack.min():.3g} to {lack.max():.3g} N are lacking; want a force that opposes the motion as a damper's does, "
        "or give wider limits"
    )
