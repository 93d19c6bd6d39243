"""A validation plan: steps, each with an output of the vehicle that matters there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from excitation import RoadProfileSpec
from excitation.configuration import STRICT
from excitation.road_profile import RoadClass
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.studies.vehicle import grounds
from identification.studies.vehicle.comfort import comfort
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.quarter_car import QuarterCar, quarter_car
from identification.studies.vehicle.ride import Held, check_dampers, ride

MATTERS = 0.02
"""Share of an output from which a change matters: a convention, well below the change of vibration that people notice
(some 10 %). Half asks for more tests and drops less; double the opposite."""
_SETTLE_S = 2.0
_STEP_S = 1e-3
_FINEST_PER_M = 10.0  # wavenumber of a road
_PLACE = "suspension"


class Step(Protocol):
    """One step of a validation plan: a function of a model that gives the vehicle's output of interest."""

    @property
    def name(self) -> str:
        """What the step is called."""
        ...

    def check(self, model: SimulationModel) -> None:
        """Raise DataError, one line, where the model cannot take this step."""
        ...

    def __call__(self, model: SimulationModel) -> float:
        """The output, SI."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadStep:
    """A quarter car on a road of ISO 8608, and one output of it; the current is held, A."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    output: Literal["weighted acceleration", "tyre force", "stroke", "power"]
    road_class: RoadClass = "C"
    speed_m_s: float = 20.0
    seconds: float = 8.0
    seed: int = 1
    current_a: float | None = None

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise DataError("a step has no name: give it one")
        if not _SETTLE_S + 1.0 <= self.seconds <= 600.0:
            raise DataError(f"step '{self.name}': seconds is {self.seconds:g}: it must lie within 3 … 600")
        if not 0.5 <= self.speed_m_s <= 150.0:
            raise DataError(f"step '{self.name}': speed is {self.speed_m_s:g} m/s: it must lie within 0.5 … 150")

    def check(self, model: SimulationModel) -> None:
        """Raise DataError where the model needs a current that the step does not give."""
        check_dampers(quarter_car(QuarterCar()), {_PLACE: model}, self._ground(), self._control())

    def _ground(self) -> Ground:
        spec = RoadProfileSpec(
            road_class=self.road_class, length_m=self.speed_m_s * self.seconds, seed=self.seed,
            max_wavenumber_per_m=min(_FINEST_PER_M, 0.4 / _STEP_S / self.speed_m_s),
        )  # fmt: skip
        return grounds.road(spec, self.speed_m_s, _STEP_S)

    def _control(self) -> Held | None:
        return None if self.current_a is None else Held(self.current_a)

    def __call__(self, model: SimulationModel) -> float:
        """rms of the output after the first two seconds, SI; power: its mean, W."""
        found = ride(quarter_car(QuarterCar()), {_PLACE: model}, self._ground(), control=self._control())
        late = slice(round(_SETTLE_S / _STEP_S), None)
        match self.output:
            case "weighted acceleration":
                return comfort(found.outputs["body_acceleration"], 1.0 / _STEP_S, settle_s=_SETTLE_S).rms
            case "tyre force":
                return float(np.std(found.outputs["tyre_force"][late]))
            case "stroke":
                return float(np.std(found.x[late, 0]))
            case "power":
                return float(np.mean(found.force[late, 0] * found.v[late, 0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The steps, and the share of an output from which a change matters."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    step: tuple[RoadStep, ...]
    matters: float = MATTERS

    def __post_init__(self) -> None:
        check_steps(self.step, self.matters)


def check_steps(steps: tuple[Step, ...], matters: float) -> None:
    """Raise DataError where there is no step, two have one name, or `matters` is no share."""
    if not steps:
        raise DataError("the plan has no step: give one or more, each with its output")
    names = [one.name for one in steps]
    if len(set(names)) < len(names):
        raise DataError(f"two steps are called '{max(names, key=names.count)}': give each its own name")
    if not 0.0 < matters < 1.0:
        raise DataError(f"matters is {matters:g}: it must be a share within 0 … 1, such as 0.02")
