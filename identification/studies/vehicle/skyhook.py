"""Skyhook control with the inverse of a damper model: the current whose force is nearest to the one that is wanted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.models.stepping import Moment, Stepper, foresees, steppable
from identification.studies.vehicle.protocol import Vehicle

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Skyhook:
    """F* = c_sky·(velocity of the sprung mass), as if a damper hung it from the sky, by one semi-active damper.

    `inverse` is the forward model whose force is looked up at `levels` currents within `lowest` … `highest`, in the
    state to which the motion has brought it; the current between two levels is interpolated. Where no current gives
    F*, as when the damper would have to push, the nearest force is taken. The current is set every `period_s`.
    """

    inverse: SimulationModel
    velocity: str = "seat_velocity"
    sky_n_s_per_m: float = 2000.0
    lowest: float = 0.0
    highest: float = 1.0
    levels: int = 6
    period_s: float = 0.005
    _now: list[_Inverse] = field(default_factory=list, repr=False, compare=False)

    def __post_init__(self) -> None:
        if "current" not in self.inverse.inputs:
            raise DataError(f"'{self.inverse.name}' does not depend on a current: it cannot be controlled")
        if not foresees(self.inverse):
            raise DataError(
                f"'{self.inverse.name}' cannot be taken back a step, so that no current can be looked up in it: export "
                "the FMU with canGetAndSetFMUState"
            )
        if not self.lowest < self.highest:
            raise DataError(f"currents from {self.lowest:g} to {self.highest:g} A: the lower one comes first")
        if not (self.levels >= 2 and self.period_s > 0.0 and self.sky_n_s_per_m >= 0.0):
            raise DataError(
                f"skyhook of {self.sky_n_s_per_m:g} N·s/m, {self.levels} levels, every {self.period_s:g} s: "
                "at least 0, 2 and more than 0"
            )

    def begin(self, vehicle: Vehicle, dt: float) -> None:
        """Forget the last ride; raises DataError where the vehicle has no such velocity or more than one damper."""
        if self.velocity not in vehicle.outputs or len(vehicle.dampers) != 1:
            raise DataError(
                f"skyhook controls one damper by the output {self.velocity!r}: {vehicle.name} has "
                f"{len(vehicle.dampers)} and {', '.join(vehicle.outputs)}"
            )
        levels = np.linspace(self.lowest, self.highest, self.levels)
        every = max(1, round(self.period_s / dt))
        self._now[:] = [_Inverse(steppable(self.inverse).stepper(dt), levels, every)]

    def currents(self, time: float, outputs: Mapping[str, float], motions: Floats) -> Floats:
        """The current, (1,), A."""
        wanted = self.sky_n_s_per_m * outputs[self.velocity]
        return np.array([self._now[0].follow(wanted, motions[0])])


class _Inverse:
    """The model that is looked into, kept where the real damper is."""

    def __init__(self, stepper: Stepper, levels: Floats, every: int) -> None:
        self._stepper, self._levels, self._every = stepper, levels, every
        self._current, self._count = float(levels[0]), -1

    def follow(self, wanted: float, motion: Floats) -> float:
        """Goes on with the motion under the last current; the current for the wanted force."""
        x, v, a = motion.tolist()
        at = Moment(x, v, a, self._current)
        if self._count < 0:
            self._stepper.start(at)
        else:
            self._stepper.advance(at)
        self._count += 1
        if self._count % self._every == 0:
            ahead = at._replace(x=x + v * self._stepper.dt, v=v + a * self._stepper.dt)
            forces = np.array([self._stepper.force(ahead._replace(i=float(i))) for i in self._levels])
            self._current = looked_up(self._levels, forces, wanted)
        return self._current


def looked_up(levels: Floats, forces: Floats, wanted: float) -> float:
    """The current whose force, linear between the levels (L,), is the wanted one, the lowest if there are several; the
    level of the nearest force where there is none.
    """
    rest = forces - wanted
    crossings = np.flatnonzero(rest[:-1] * rest[1:] < 0.0)
    if crossings.size == 0:
        return float(levels[np.argmin(np.abs(rest))])
    k = crossings[0]
    share = rest[k] / (rest[k] - rest[k + 1])
    return float(levels[k] + share * (levels[k + 1] - levels[k]))
