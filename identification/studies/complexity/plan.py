"""A validation plan: steps, each with an output of the vehicle that matters there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
from pydantic import Discriminator, Tag

from excitation import RoadProfileSpec
from excitation.configuration import STRICT
from excitation.road_profile import RoadClass
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.studies.vehicle import grounds
from identification.studies.vehicle.bogie import Bogie
from identification.studies.vehicle.bogie_study import OnRail, check_bogie_study, hunting, stability
from identification.studies.vehicle.comfort import comfort
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.quarter_car import QuarterCar, quarter_car
from identification.studies.vehicle.ride import Held, check_dampers, ride
from identification.studies.vehicle.seat import seat_suspension
from identification.studies.vehicle.seat_study import OnSeat, random_floor
from identification.studies.vehicle.step import step_for

MATTERS = 0.02
"""Share of an output from which a change matters: a convention, well below the change of vibration that people notice
(some 10 %). Half asks for more tests and drops less; double the opposite."""
_SETTLE_S = 2.0
_FINEST_PER_M = 10.0  # wavenumber of a road
_PLACE = "suspension"
_FINE_M_S = 0.1  # of a critical speed: a fifth of a share that matters, at 60 m/s


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
    vehicle: str = "car"
    road_class: RoadClass = "C"
    speed_m_s: float = 20.0
    seconds: float = 8.0
    seed: int = 1
    current_a: float | None = None

    def __post_init__(self) -> None:
        _check_name(self.name)
        if self.vehicle != "car":
            raise DataError(f"step '{self.name}': vehicle is {self.vehicle!r:.40}: use car, seat or bogie")
        if not _SETTLE_S + 1.0 <= self.seconds <= 600.0:
            raise DataError(f"step '{self.name}': seconds is {self.seconds:g}: it must lie within 3 … 600")
        if not 0.5 <= self.speed_m_s <= 150.0:
            raise DataError(f"step '{self.name}': speed is {self.speed_m_s:g} m/s: it must lie within 0.5 … 150")

    def check(self, model: SimulationModel) -> None:
        """Raise DataError where the model needs a current that the step does not give."""
        check_dampers(quarter_car(QuarterCar()), {_PLACE: model}, self._ground(model), self._control())

    def _ground(self, model: SimulationModel) -> Ground:
        dt = step_for([model])
        spec = RoadProfileSpec(
            road_class=self.road_class, length_m=self.speed_m_s * self.seconds, seed=self.seed,
            max_wavenumber_per_m=min(_FINEST_PER_M, 0.4 / dt / self.speed_m_s),
        )  # fmt: skip
        return grounds.road(spec, self.speed_m_s, dt)

    def _control(self) -> Held | None:
        return None if self.current_a is None else Held(self.current_a)

    def __call__(self, model: SimulationModel) -> float:
        """rms of the output after the first two seconds, SI; power: its mean, W."""
        ground = self._ground(model)
        found = ride(quarter_car(QuarterCar()), {_PLACE: model}, ground, control=self._control())
        late = slice(round(_SETTLE_S / ground.dt), None)
        match self.output:
            case "weighted acceleration":
                return comfort(found.outputs["body_acceleration"], 1.0 / ground.dt, settle_s=_SETTLE_S).rms
            case "tyre force":
                return float(np.std(found.outputs["tyre_force"][late]))
            case "stroke":
                return float(np.std(found.x[late, 0]))
            case "power":
                return float(np.mean(found.force[late, 0] * found.v[late, 0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class SeatStep:
    """A passenger on a seat over a random floor, 1 … 10 Hz, and one output; the current is held, A."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    vehicle: Literal["seat"]
    output: Literal["weighted acceleration", "stroke", "power"]
    rms_m: float = 0.006
    seed: int = 1
    current_a: float | None = None

    def __post_init__(self) -> None:
        _check_name(self.name)
        if not 0.0 < self.rms_m <= 0.1:
            raise DataError(f"step '{self.name}': rms is {self.rms_m:g} m: it must lie within (0, 0.1]")

    def check(self, model: SimulationModel) -> None:
        """Raise DataError where the model needs a current that the step does not give."""
        check_dampers(seat_suspension(), {_PLACE: model}, self._ground(model), self._control())

    def _ground(self, model: SimulationModel) -> Ground:
        return random_floor(OnSeat(random_rms_m=self.rms_m, seed=self.seed), step_for([model]))

    def _control(self) -> Held | None:
        return None if self.current_a is None else Held(self.current_a)

    def __call__(self, model: SimulationModel) -> float:
        """rms of the output over the second period of the floor, SI; power: its mean, W."""
        ground = self._ground(model)
        found = ride(seat_suspension(), {_PLACE: model}, ground, control=self._control())
        late = slice(found.time.size // 2, None)
        match self.output:
            case "weighted acceleration":
                settled = found.time.size // 2 * ground.dt
                return comfort(found.outputs["passenger_acceleration"], 1.0 / ground.dt, settle_s=settled).rms
            case "stroke":
                return float(np.std(found.x[late, 0]))
            case "power":
                return float(np.mean(found.force[late, 0] * found.v[late, 0]))


@dataclass(frozen=True, slots=True, kw_only=True)
class BogieStep:
    """A bogie with the model as yaw dampers, shifted sideways; the current is held, A.

    `critical speed`, m/s; `damper force`: the highest on the way to rest at `speed_m_s`, N; `decay`: rms of the front
    wheelset's motion there over the shift.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    vehicle: Literal["bogie"]
    output: Literal["critical speed", "damper force", "decay"]
    speed_m_s: float = 60.0
    low_m_s: float = 30.0
    high_m_s: float = 120.0
    speeds: int = 7
    seconds: float = 3.0
    current_a: float | None = None

    def __post_init__(self) -> None:
        _check_name(self.name)
        self._given()

    def check(self, model: SimulationModel) -> None:
        """Raise DataError where the model cannot be a yaw damper of this step."""
        check_bogie_study([model], self._given())

    def _given(self) -> OnRail:
        return OnRail(
            bogie=Bogie(speed_m_s=self.speed_m_s), low_m_s=self.low_m_s, high_m_s=self.high_m_s, speeds=self.speeds,
            resolution_m_s=_FINE_M_S, seconds=self.seconds, current=self.current_a,
        )  # fmt: skip

    def __call__(self, model: SimulationModel) -> float:
        """The output; of a bogie without a limit cycle the critical speed is the highest speed of the step."""
        given = self._given()
        if self.output == "critical speed":
            found = stability(model, given).critical_m_s
            return found if np.isfinite(found) else self.high_m_s
        shown = hunting(model, given, self.speed_m_s)
        if self.output == "damper force":
            return float(np.max(np.abs(shown.force)))
        return float(np.sqrt(np.mean(shown.outputs["front_wheelset"] ** 2))) / given.bogie.shift_m


def _check_name(name: str) -> None:
    if not name.strip():
        raise DataError("a step has no name: give it one")


def _class_of(given: Any) -> str:
    """The class that a step in a configuration states by its vehicle. Any: what JSON can say, or a step."""
    vehicle = given.get("vehicle") if isinstance(given, Mapping) else given.vehicle
    return {"seat": "SeatStep", "bogie": "BogieStep"}.get(str(vehicle), "RoadStep")


AnyStep = Annotated[
    Annotated[RoadStep, Tag("RoadStep")]
    | Annotated[SeatStep, Tag("SeatStep")]
    | Annotated[BogieStep, Tag("BogieStep")],
    Discriminator(_class_of),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The steps, and the share of an output from which a change matters."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    step: tuple[AnyStep, ...]
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
