"""A specimen of six axes in the rig: the actuator moves the main axis, the further axes are held where they were set.

Nothing moves the further axes: the rig measures their places and all six loads on its sample clock.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.device import PressureStage
from rigctl.further_axes import FURTHER_AXES
from sim_rig.errors import SpecimenError
from sim_rig.multi_axis import MultiAxisSpecimen, step
from sim_rig.plant import SimulatedPlant

Floats = NDArray[np.float64]

PLACES: Final = tuple(FURTHER_AXES)[:5]
MOST: Final = (0.02, 0.02, 0.1, 0.1, 0.1)  # m, rad: five times what the bushes see in service
NOISE: Final = np.array([1e-6, 1e-6, 1e-5, 1e-5, 1e-5, 5.0, 5.0, 0.3, 0.3, 0.3])  # standard deviations, SI
INNER_HZ: Final = 2e3  # the oil behind the bush settles within 10 ms


def held_places(orders: Sequence[str]) -> tuple[float, ...]:
    """Places of y, z, m, and rx, ry, rz, rad, from orders such as ``displacement_y=0.004``; 0 where there is none.

    Raises SpecimenError for a channel that is no place, or a place outside of what the bushes take.
    """
    places = dict.fromkeys(PLACES, 0.0)
    for text in orders:
        name, _, value = text.partition("=")
        try:
            place = float(value)
        except ValueError:
            place = math.nan
        most = dict(zip(PLACES, MOST, strict=True)).get(name, 0.0)
        if not abs(place) <= most or name not in PLACES:
            limits = ", ".join(f"{one} (±{most:g})" for one, most in zip(PLACES, MOST, strict=True))
            raise SpecimenError(f"place '{text}': write CHANNEL=VALUE in m or rad with one of {limits}")
        places[name] = place
    return tuple(places.values())


@dataclass(slots=True)
class _Body:
    """What the specimen remembers: the place of the oil's piston, its frictions, the last place of the main axis."""

    oil: float
    bent: list[float]
    x: float

    def copy(self) -> _Body:
        return _Body(self.oil, self.bent.copy(), self.x)


class MultiAxisPlant:
    """Readings of 15 channels, (n, 15): those of a rig of one axis, then those of the further axes."""

    def __init__(
        self, inner: SimulatedPlant, specimen: MultiAxisSpecimen, *, held: Sequence[float] = (0.0,) * 5, seed: int
    ) -> None:
        """`inner`: the actuator, loaded by a damper of one axis of this size, and the sensors of the main axis."""
        self._inner, self._specimen, self._held = inner, specimen, list(held)
        self._body = _Body(0.0, [0.0] * 6, 0.0)
        self._seed, self._runs, self._rate_hz = seed, 0, 1000.0
        self._random = np.random.default_rng([seed, 0, len(PLACES)])

    def set_rate(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._inner.set_rate(rate_hz)

    def set_stage(self, stage: PressureStage) -> None:
        self._inner.set_stage(stage)

    def begin_run(self) -> None:
        self._inner.begin_run()
        self._runs += 1
        self._random = np.random.default_rng([self._seed, self._runs, len(PLACES)])

    @property
    def jammed(self) -> bool:
        """Whether the valve is stuck."""
        return self._inner.jammed

    @jammed.setter
    def jammed(self, jammed: bool) -> None:
        self._inner.jammed = jammed

    def heat(self, degc: float) -> None:
        """Set the temperature of the damper."""
        self._inner.heat(degc)

    def play(self, setpoints: Floats) -> Floats:
        truth = self._inner.true_samples(setpoints)
        loads = self._loads(truth[:, 1])
        truth[:, 0] = loads[:, 0]
        further = np.hstack([np.tile(self._held, (truth.shape[0], 1)), loads[:, 1:]])
        main = self._inner.sensed(truth)
        further += NOISE * self._random.standard_normal(further.shape)
        lsb = np.array(scaling.FURTHER)
        return np.hstack([main, np.round(further / lsb) * lsb])

    def _loads(self, x: Floats) -> Floats:
        """The six loads at each place of the main axis, (n, 6); between two it moves in a straight line."""
        fine = max(math.ceil(INNER_HZ / self._rate_hz), 1)
        dt, body = 1.0 / (self._rate_hz * fine), self._body
        loads, still = np.empty((x.size, 6)), [0.0] * 5
        for k, place in enumerate(x.tolist()):
            speed = [(place - body.x) / (fine * dt), *still]
            for j in range(1, fine + 1):
                at = [body.x + (place - body.x) * j / fine, *self._held]
                body.oil, row = step(self._specimen, at, speed, body.oil, body.bent, dt)
            loads[k], body.x = row, place
        return loads

    def snapshot(self) -> object:
        return self._inner.snapshot(), self._body.copy(), self._random.bit_generator.state

    def restore(self, snapshot: object) -> None:
        assert isinstance(snapshot, tuple)
        inner, body, self._random.bit_generator.state = snapshot
        self._inner.restore(inner)
        self._body = body.copy()
