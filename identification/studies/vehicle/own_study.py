"""Dampers in a vehicle of the user's own, Python functions or an FMU: its outputs on a road and over a multisine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from excitation import RoadProfileSpec
from excitation.configuration import STRICT
from excitation.road_profile import RoadClass
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.studies.pace import silent
from identification.studies.vehicle import grounds
from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, labels_of
from identification.studies.vehicle.comfort import comfort
from identification.studies.vehicle.fmu_vehicle import FmuVehicle
from identification.studies.vehicle.parts import Part, rides
from identification.studies.vehicle.protocol import Ground, Vehicle
from identification.studies.vehicle.ride import Control, Held, Ride, check_dampers
from identification.studies.vehicle.road_study import notes_of
from identification.studies.vehicle.step import step_for
from identification.studies.vehicle.transmissibility import Transmissibility, by_multisine

Tell = Callable[[float, str], None]
_SETTLE_S = 2.0
_SHOWN_S = 8.0
_FELT = "m/s²"  # the unit of an output that is weighted as comfort
_MOVED = "m"  # of one that has a transmissibility


@dataclass(frozen=True, slots=True, kw_only=True)
class OnOwn:
    """A vehicle on a road of ISO 8608; the current is held, A. All dampers are of the same model.

    `behind_m`: how far behind the first ground each other ground meets the road; of an FMU its wiring states that.
    The multisine excites all grounds alike, 0.5 … 20 Hz with `rms_m`, and repeats after `period_s`.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    road_class: RoadClass = "C"
    speed_m_s: float = 20.0
    seconds: float = 20.0
    seed: int = 1
    current: float | None = None
    behind_m: tuple[float, ...] = ()
    rms_m: float = 0.008
    period_s: float = 8.0
    step_s: float | None = None

    def __post_init__(self) -> None:
        if not 5.0 <= self.seconds <= 600.0:
            raise DataError(f"seconds is {self.seconds:g}: it must lie within [5, 600]")
        if not 0.5 <= self.speed_m_s <= 150.0:
            raise DataError(f"speed is {self.speed_m_s:g} m/s: it must lie within [0.5, 150]")
        if any(not 0.0 <= one <= 100.0 for one in self.behind_m):
            raise DataError(f"behind is {list(self.behind_m)} m: each must lie within 0 … 100")


def own_study(
    vehicle: Vehicle, models: Sequence[SimulationModel], given: OnOwn | None = None, *, on_progress: Tell | None = None
) -> Study:
    """The outputs of a vehicle of the user's own with every model as its dampers, in the order given.

    Of every output the rms; of one in m/s² the weighted acceleration (ISO 2631-1, Wk) too; of one in m the
    transmissibility; of every damper stroke and power.

    Raises
    ------
    DataError
        before the work, one line: no model, a model without its current, steps that do not agree.
    SimulationError
        as `ride` does, and where an FMU fails.
    """
    given = given or OnOwn()
    ground, control = check_own_study(vehicle, models, given)
    labels, dt = labels_of([m.name for m in models]), ground.dt
    tones = grounds.tones(0.5, 20.0, given.rms_m, given.period_s, dt, given.seed)
    excited = grounds.delayed(grounds.multisine(tones, 3, dt), [0.0] * len(vehicle.grounds))
    over = [ground, *([excited] if _moved(vehicle) else [])]
    parts = [
        Part(vehicle=vehicle, dampers=dict.fromkeys(vehicle.dampers, model), ground=one, control=control)
        for model in models
        for one in over
    ]
    found = rides(parts, on_progress or silent, f"dampers in {vehicle.name}")
    answers = []
    for k, (label, model) in enumerate(zip(labels, models, strict=True)):
        first, *second = found[k * len(over) : (k + 1) * len(over)]
        answered = [
            by_multisine(one, excited, name, tones.lines, tones.period_samples)
            for one in second
            for name in _moved(vehicle)
        ]
        answers.append(_answer(label, model, vehicle, first, answered))
    setting = (
        f"{vehicle.name} on a road of class {given.road_class} (ISO 8608) at {3.6 * given.speed_m_s:.4g} km/h for "
        f"{given.seconds:g} s, step {1e3 * ground.dt:g} ms"
    )
    return Study(title=f"Dampers in {vehicle.name}", setting=setting, answers=tuple(answers), facts=asdict(given))


def check_own_study(vehicle: Vehicle, models: Sequence[SimulationModel], given: OnOwn) -> tuple[Ground, Control | None]:
    """The road and what sets the current; raises DataError, one line, where the study cannot begin."""
    if not models:
        raise DataError("no model is given: a study compares one or more")
    dt = step_for(models, given.step_s)
    spec = RoadProfileSpec(
        road_class=given.road_class, length_m=given.speed_m_s * given.seconds, seed=given.seed,
        max_wavenumber_per_m=min(10.0, 0.4 / dt / given.speed_m_s),
    )  # fmt: skip
    ground = grounds.delayed(grounds.road(spec, given.speed_m_s, dt), _delays(vehicle, given))
    control = None if given.current is None else Held(given.current)
    for model in models:
        check_dampers(vehicle, dict.fromkeys(vehicle.dampers, model), ground, control)
    return ground, control


def _delays(vehicle: Vehicle, given: OnOwn) -> list[float]:
    """How much later than the first each ground meets the road, s."""
    if isinstance(vehicle, FmuVehicle):
        behind = [one.behind_m for one in vehicle.wiring.ground]
    else:
        behind = list(given.behind_m) or [0.0] * len(vehicle.grounds)
    if len(behind) != len(vehicle.grounds):
        raise DataError(
            f"behind has {len(behind)} entries: {vehicle.name} stands on {', '.join(vehicle.grounds)}: one for each"
        )
    return [one / given.speed_m_s for one in behind]


def _moved(vehicle: Vehicle) -> list[str]:
    """The outputs that have a transmissibility."""
    return [name for name, unit in vehicle.outputs.items() if unit == _MOVED]


def _answer(
    label: str, model: SimulationModel, vehicle: Vehicle, found: Ride, answered: Sequence[Transmissibility]
) -> Answer:
    figures, curves = _figures(vehicle, found, float(found.time[1])), _histories(vehicle, found)
    for one in answered:
        name = one.output
        figures += [Figure(name=f"peak of the transmissibility to {name}", unit="", value=one.peak[1])]
        curves += [
            Curve(title=f"Transmissibility to {name}, multisine", x_name="frequency, Hz", y_name=f"{name} / ground",
                  x=one.frequency_hz, y=np.abs(one.ratio))
        ]  # fmt: skip
    notes = [*notes_of(model, found)]
    if isinstance(vehicle, FmuVehicle) and not vehicle.back:
        notes.append("the vehicle's FMU cannot be taken back a step: it meets each force one step late; see --step")
    return Answer(label=label, figures=tuple(figures), curves=tuple(curves), notes=tuple(notes))


def _figures(vehicle: Vehicle, found: Ride, dt: float) -> list[Figure]:
    late = slice(round(_SETTLE_S / dt), None)
    figures = []
    for name, unit in vehicle.outputs.items():
        series = found.outputs[name]
        if unit == _FELT:
            felt = comfort(series, 1.0 / dt, settle_s=_SETTLE_S)
            figures.append(Figure(name=f"weighted {name} (Wk)", unit=unit, value=felt.rms))
        figures.append(Figure(name=f"rms of {name}", unit=unit, value=float(np.std(series[late]))))
    for k, place in enumerate(vehicle.dampers):
        figures += [
            Figure(name=f"rms of the stroke of {place}", unit="m", value=float(np.std(found.x[late, k]))),
            Figure(name=f"power in {place}", unit="W", value=float(np.mean(found.force[late, k] * found.v[late, k]))),
        ]
    return figures


def _histories(vehicle: Vehicle, found: Ride) -> list[Curve]:
    shown = slice(None, min(found.time.size, round(_SHOWN_S / (found.time[1] - found.time[0]))))
    curves = [
        Curve(title=f"{name} on the road", x_name="time, s", y_name=f"{name}, {unit}" if unit else name,
              x=found.time[shown], y=found.outputs[name][shown])
        for name, unit in vehicle.outputs.items()
    ]  # fmt: skip
    for k, place in enumerate(vehicle.dampers):
        curves.append(
            Curve(title=f"Force over velocity of {place} on the road", x_name="velocity, m/s", y_name="force, N",
                  x=found.v[shown, k], y=found.force[shown, k], style="markers")
        )  # fmt: skip
    return curves
