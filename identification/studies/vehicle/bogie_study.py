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
from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, labels_of
from identification.studies.vehicle.bogie import Bogie, RailBogie
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.ride import Held, Ride, check_dampers, ride
from identification.studies.vehicle.road_study import notes_of, part_of
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
    tell = on_progress or _silent
    speeds = np.linspace(given.low_m_s, given.high_m_s, given.speeds)
    amplitudes = []
    for k, speed in enumerate(speeds):
        tell(k / (speeds.size + 4), f"{3.6 * speed:.0f} km/h")
        amplitudes.append(limit_cycle(hunting(model, given, float(speed))))
    amplitude = np.array(amplitudes)
    cycling = np.flatnonzero(amplitude > 0.0)
    if cycling.size == 0:
        return Stability(speed_m_s=speeds, amplitude_m=amplitude, critical_m_s=np.nan)
    first = int(cycling[0])
    low, high = float(speeds[max(first - 1, 0)]), float(speeds[first])
    while first > 0 and high - low > given.resolution_m_s:
        middle = 0.5 * (low + high)
        tell(speeds.size / (speeds.size + 4), f"critical speed: {3.6 * middle:.1f} km/h")
        cycle = limit_cycle(hunting(model, given, middle))
        low, high = (low, middle) if cycle > 0.0 else (middle, high)
    return Stability(speed_m_s=speeds, amplitude_m=amplitude, critical_m_s=high)


def hunting(model: SimulationModel, given: OnRail, speed_m_s: float) -> Ride:
    """The motion of the bogie on a straight track from its shift on."""
    dt = step_for([model], given.step_s)
    rail = np.zeros((round(given.seconds / dt), 2))
    vehicle = RailBogie(replace(given.bogie, speed_m_s=speed_m_s))
    control = None if given.current is None else Held(given.current)
    dampers = dict.fromkeys(vehicle.dampers, model)
    return ride(vehicle, dampers, Ground(dt=dt, x=rail, v=rail, a=rail), control=control)


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
    answers = []
    for k, (label, model) in enumerate(zip(labels_of([m.name for m in models]), models, strict=True)):
        tell = part_of(on_progress, k / len(models), 1.0 / len(models), label)
        answers.append(_answer(label, model, given, tell))
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


def _answer(label: str, model: SimulationModel, given: OnRail, tell: Tell) -> Answer:
    found = stability(model, given, on_progress=part_of(tell, 0.0, 0.95, ""))
    shown = hunting(model, given, given.bogie.speed_m_s)
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


def _silent(done: float, what: str) -> None:
    """Says nothing."""
