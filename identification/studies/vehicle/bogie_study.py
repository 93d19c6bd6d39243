"""Yaw dampers in the bogie: limit cycles over speed, and the speed from which the bogie no longer comes to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.studies.pace import part, silent
from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, labels_of
from identification.studies.vehicle.bogie import Bogie, RailBogie
from identification.studies.vehicle.parts import Part, rides
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.ride import Held, Ride, check_dampers
from identification.studies.vehicle.road_study import notes_of
from identification.studies.vehicle.step import step_for

Tell = Callable[[float, str], None]
Floats = NDArray[np.float64]

# The bogie is at rest below this amplitude of the front wheelset, m. It is what track irregularities of a good line
# come to; half or double moves no critical speed of the examples by more than the resolution.
AT_REST_M = 1e-4
# A motion that falls by less than this share from one quarter of the time to the next stays. Closer to 1 asks for
# longer runs; at 0.8 slow decays near the critical speed count as limit cycles, some km/h too early.
_STAYS = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class OnRail:
    """A bogie shifted sideways at the beginning, at speeds from `low` to `high`, m/s, for `seconds` each.

    The critical speed is sought between two of the `speeds` to `resolution`, m/s. It holds for the shift: a larger one
    may find a limit cycle at a lower speed.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    bogie: Bogie = field(default_factory=Bogie)
    low_m_s: float = 30.0
    high_m_s: float = 120.0
    speeds: int = 10
    resolution_m_s: float = 0.5
    seconds: float = 4.0
    current: float | None = None
    step_s: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.low_m_s < self.high_m_s <= 300.0:
            raise DataError(f"speeds from {self.low_m_s:g} to {self.high_m_s:g} m/s: within (0, 300], the lower first")
        if not (2 <= self.speeds <= 200 and self.resolution_m_s > 0.0 and 1.0 <= self.seconds <= 120.0):
            raise DataError("bogie study: 2 … 200 speeds, a resolution above 0 m/s and 1 … 120 seconds")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stability:
    """Amplitude of the front wheelset's limit cycle, m, 0 where it comes to rest, at each speed, m/s, (K,).

    `critical_m_s` is the lowest speed with a limit cycle; NaN where there is none up to the highest.
    """

    speed_m_s: Floats
    amplitude_m: Floats
    critical_m_s: float


def stability(model: SimulationModel, given: OnRail, *, on_progress: Tell | None = None) -> Stability:
    """Limit cycles with the model as either yaw damper; raises DataError and SimulationError as `ride` does."""
    return stabilities([model], given, on_progress=on_progress)[0]


def stabilities(
    models: Sequence[SimulationModel], given: OnRail, *, on_progress: Tell | None = None
) -> list[Stability]:
    """The same of every model: all speeds at once, then the critical speeds of all by halving."""
    tell = on_progress or silent
    speeds = np.linspace(given.low_m_s, given.high_m_s, given.speeds)
    parts = [hunting_part(model, given, float(speed)) for model in models for speed in speeds]
    found = rides(parts, part(tell, 0.0, 0.7), "speeds")
    amplitude = np.array([limit_cycle(one) for one in found]).reshape(len(models), speeds.size)
    within: dict[int, tuple[float, float]] = {}
    for k, row in enumerate(amplitude):
        cycling = np.flatnonzero(row > 0.0)
        if cycling.size:
            within[k] = float(speeds[max(cycling[0] - 1, 0)]), float(speeds[cycling[0]])
    while wide := [k for k, (low, high) in within.items() if high - low > given.resolution_m_s]:
        middles = [0.5 * sum(within[k]) for k in wide]
        halves = [hunting_part(models[k], given, middle) for k, middle in zip(wide, middles, strict=True)]
        for k, middle, one in zip(wide, middles, rides(halves, part(tell, 0.7, 0.9), "critical speed"), strict=True):
            low, high = within[k]
            within[k] = (low, middle) if limit_cycle(one) > 0.0 else (middle, high)
    return [
        Stability(speed_m_s=speeds, amplitude_m=row, critical_m_s=within[k][1] if k in within else np.nan)
        for k, row in enumerate(amplitude)
    ]


def hunting(model: SimulationModel, given: OnRail, speed_m_s: float) -> Ride:
    """The motion of the bogie on a straight track from its shift on."""
    return hunting_part(model, given, speed_m_s).ridden()


def hunting_part(model: SimulationModel, given: OnRail, speed_m_s: float) -> Part:
    """The same, to be ridden."""
    dt = step_for([model], given.step_s)
    rail = np.zeros((round(given.seconds / dt), 2))
    vehicle = RailBogie(replace(given.bogie, speed_m_s=speed_m_s))
    control = None if given.current is None else Held(given.current)
    dampers = dict.fromkeys(vehicle.dampers, model)
    return Part(vehicle=vehicle, dampers=dampers, ground=Ground(dt=dt, x=rail, v=rail, a=rail), control=control)


def limit_cycle(found: Ride) -> float:
    """Half the range of the front wheelset's motion in the last quarter, m; 0 where that falls or is at rest."""
    quarters = np.array_split(found.outputs["front_wheelset"], 4)
    before, last = (0.5 * float(np.ptp(one)) for one in quarters[-2:])
    return last if last > AT_REST_M and last >= _STAYS * before else 0.0


def bogie_study(
    models: Sequence[SimulationModel], given: OnRail | None = None, *, on_progress: Tell | None = None
) -> Study:
    """Critical speed and limit cycles with every model as yaw damper, in the order given.

    Raises
    ------
    DataError
        before the work, one line: no model, a model without its current, steps that do not agree.
    SimulationError
        as `ride` does.
    """
    given = given or OnRail()
    check_bogie_study(models, given)
    tell = on_progress or silent
    found = stabilities(models, given, on_progress=tell)
    shown = [hunting_part(model, given, given.bogie.speed_m_s) for model in models]
    ridden = rides(shown, part(tell, 0.9, 1.0), "the way to rest")
    labels = labels_of([m.name for m in models])
    answers = [
        _answer(label, model, given, one, ride_of)
        for label, model, one, ride_of in zip(labels, models, found, ridden, strict=True)
    ]
    setting = (
        f"Bogie with a yaw damper on either side, conicity {given.bogie.conicity:g}, from a shift of "
        f"{1e3 * given.bogie.shift_m:g} mm, {3.6 * given.low_m_s:.4g} … {3.6 * given.high_m_s:.4g} km/h"
    )
    return Study(title="Yaw dampers in the bogie", setting=setting, answers=tuple(answers), facts=asdict(given))


def check_bogie_study(models: Sequence[SimulationModel], given: OnRail) -> None:
    """Raise DataError, one line, where the study cannot begin."""
    if not models:
        raise DataError("no model is given: a study compares one or more")
    step, vehicle = step_for(models, given.step_s), RailBogie(given.bogie)
    flat = Ground(dt=step, x=np.zeros((2, 2)), v=np.zeros((2, 2)), a=np.zeros((2, 2)))
    control = None if given.current is None else Held(given.current)
    for model in models:
        check_dampers(vehicle, dict.fromkeys(vehicle.dampers, model), flat, control)


def _answer(label: str, model: SimulationModel, given: OnRail, found: Stability, shown: Ride) -> Answer:
    unstable = found.amplitude_m > 0.0
    figures = (
        Figure(name="critical speed", unit="km/h", value=3.6 * found.critical_m_s),
        Figure(name="limit cycle at the highest speed", unit="mm", value=1e3 * float(found.amplitude_m[-1])),
        Figure(name="highest damper force on the way to rest", unit="N", value=float(np.max(np.abs(shown.force)))),
    )
    title = f"Front wheelset at {3.6 * given.bogie.speed_m_s:.4g} km/h"
    y = 1e3 * shown.outputs["front_wheelset"]
    curves = (
        Curve(title="Limit cycle over speed", x_name="speed, km/h", y_name="amplitude of the front wheelset, mm",
              x=3.6 * found.speed_m_s, y=1e3 * found.amplitude_m),
        Curve(title=title, x_name="time, s", y_name="lateral displacement, mm", x=shown.time, y=y),
    )  # fmt: skip
    notes = list(notes_of(model, shown))
    if not unstable.any():
        notes.append("no limit cycle up to the highest speed: the critical speed lies above")
    elif unstable[0]:
        notes.append("a limit cycle at the lowest speed already: the critical speed lies below")
    return Answer(label=label, figures=figures, curves=curves, notes=tuple(notes))
