"""Dampers in the quarter car: comfort on a road, and transmissibility by multisine and by stepped sine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np

from excitation import RoadProfileSpec
from excitation.configuration import STRICT
from excitation.road_profile import RoadClass
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.models.stepping import foresees
from identification.physical.model import Model
from identification.physical.stepping import left_out
from identification.studies.pace import silent
from identification.studies.vehicle import grounds
from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, labels_of
from identification.studies.vehicle.comfort import comfort
from identification.studies.vehicle.parts import Part, rides
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.quarter_car import QuarterCar, quarter_car
from identification.studies.vehicle.ride import Control, Held, Ride, check_dampers, left_training
from identification.studies.vehicle.step import step_for
from identification.studies.vehicle.transmissibility import Transmissibility, by_multisine, by_sines, sine_parts

PLACE = "suspension"
Tell = Callable[[float, str], None]
_SETTLE_S = 2.0
_LONGEST_S = 600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OnRoad:
    """A quarter car on a road of ISO 8608 for so many seconds; the current is held, A, None: no damper needs one.

    The multisine excites 0.5 … 20 Hz with `rms_m` and repeats after `period_s`; the stepped sine has the amplitude
    `amplitude_m` at each of its frequencies, and is left out where there are none.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    car: QuarterCar = field(default_factory=QuarterCar)
    road_class: RoadClass = "C"
    speed_m_s: float = 20.0
    seconds: float = 20.0
    seed: int = 1
    current: float | None = None
    rms_m: float = 0.008
    period_s: float = 8.0
    sines_hz: tuple[float, ...] = ()
    amplitude_m: float = 0.01
    step_s: float | None = None

    def __post_init__(self) -> None:
        if not 5.0 <= self.seconds <= _LONGEST_S:
            raise DataError(f"seconds is {self.seconds:g}: it must lie within [5, {_LONGEST_S:g}]")
        if not 0.5 <= self.speed_m_s <= 150.0:
            raise DataError(f"speed is {self.speed_m_s:g} m/s: it must lie within [0.5, 150]")


def road_study(
    models: Sequence[SimulationModel], given: OnRoad | None = None, *, on_progress: Tell | None = None
) -> Study:
    """The figures of every model in the quarter car, in the order given.

    Raises
    ------
    DataError
        before the work, one line: no model, a model without its current, steps that do not agree.
    SimulationError
        as `ride` does.
    """
    given = given or OnRoad()
    ground, control = check_road_study(models, given)
    dt, labels = ground.dt, labels_of([m.name for m in models])
    asked = [_Asked(model, given, ground, control) for model in models]
    found = rides([part for one in asked for part in one.parts], on_progress or silent, "dampers in the quarter car")
    answers, at = [], 0
    for label, one in zip(labels, asked, strict=True):
        answers.append(_answer(label, one, found[at : at + len(one.parts)]))
        at += len(one.parts)
    setting = (
        f"Quarter car on a road of class {given.road_class} (ISO 8608) at {3.6 * given.speed_m_s:.4g} km/h for "
        f"{given.seconds:g} s, step {1e3 * dt:g} ms"
    )
    return Study(title="Dampers in the quarter car", setting=setting, answers=tuple(answers), facts=asdict(given))


def check_road_study(models: Sequence[SimulationModel], given: OnRoad) -> tuple[Ground, Control | None]:
    """The road and what sets the current; raises DataError, one line, where the study cannot begin."""
    if not models:
        raise DataError("no model is given: a study compares one or more")
    dt = step_for(models, given.step_s)
    spec = RoadProfileSpec(
        road_class=given.road_class,
        length_m=given.speed_m_s * given.seconds,
        seed=given.seed,
        max_wavenumber_per_m=min(10.0, 0.4 / dt / given.speed_m_s),
    )
    ground, vehicle = grounds.road(spec, given.speed_m_s, dt), quarter_car(given.car)
    control = None if given.current is None else Held(given.current)
    for model in models:
        check_dampers(vehicle, {PLACE: model}, ground, control)
    return ground, control


class _Asked:
    """The rides of one model: on the road, over the multisine, over each sine."""

    def __init__(self, model: SimulationModel, given: OnRoad, ground: Ground, control: Control | None) -> None:
        vehicle, dampers, dt = quarter_car(given.car), {PLACE: model}, ground.dt
        self.model, self.given = model, given
        self.tones = grounds.tones(0.5, 20.0, given.rms_m, given.period_s, dt, given.seed)
        excited = grounds.multisine(self.tones, 3, dt)
        two = [Part(vehicle=vehicle, dampers=dampers, ground=one, control=control) for one in (ground, excited)]
        self.parts = [*two, *sine_parts(vehicle, dampers, given.sines_hz, given.amplitude_m, dt, control)]


def _answer(label: str, asked: _Asked, rides_of: Sequence[Ride]) -> Answer:
    model, given, tones = asked.model, asked.given, asked.tones
    found, answer, *sines = rides_of
    excited = asked.parts[1].ground
    dt = excited.dt
    curves = [by_multisine(answer, excited, "body", tones.lines, tones.period_samples)]
    if sines:
        curves.append(by_sines(sines, asked.parts[2:], "body", given.sines_hz))
    felt = comfort(found.outputs["body_acceleration"], 1.0 / dt, settle_s=_SETTLE_S)
    late = slice(round(_SETTLE_S / dt), None)
    peak_hz, peak = curves[-1].peak
    figures = (
        Figure(name="weighted acceleration a_w (Wk)", unit="m/s²", value=felt.rms),
        Figure(name="highest a_w over 1 s (MTVV)", unit="m/s²", value=felt.highest),
        Figure(name="vibration dose (VDV)", unit="m/s^1.75", value=felt.dose),
        Figure(name="rms of the tyre force", unit="N", value=float(np.std(found.outputs["tyre_force"][late]))),
        Figure(name="rms of the stroke", unit="m", value=float(np.std(found.x[late, 0]))),
        Figure(name="power in the damper", unit="W", value=float(np.mean(found.force[late, 0] * found.v[late, 0]))),
        Figure(name="peak of the transmissibility", unit="", value=peak),
        Figure(name="frequency of the peak", unit="Hz", value=peak_hz),
    )
    notes = (f"comfort: {felt.words}", *notes_of(model, found))
    return Answer(label=label, figures=figures, curves=(*_drawn(curves), *_histories(found)), notes=notes)


def notes_of(model: SimulationModel, found: Ride) -> tuple[str, ...]:
    """What limits an answer: parts of a model that stay at the rig, motions beyond its training, forces not met."""
    notes = []
    if isinstance(model, Model) and left_out(model):
        notes.append(f"{', '.join(left_out(model))} belong to the rig, not to a damper in a vehicle: left out")
    for signal, share in left_training(model, found, 0).items():
        notes.append(f"{signal} leaves the training range in {100.0 * share:.2g} % of the samples")
    if not foresees(model):
        share = float(np.max(found.missed / np.maximum(np.std(found.force, axis=0), 1e-12)))
        notes.append(
            "the FMU cannot be taken back a step: each force is guessed by its slope over velocity, and put right "
            f"at the next sample; the guess is off by {100.0 * share:.2g} % (rms); half the --step shows what that does"
        )
    if found.loose:
        notes.append(f"force and motion did not come to agree at {found.loose} of {found.time.size} samples")
    return tuple(notes)


def _drawn(found: Sequence[Transmissibility]) -> list[Curve]:
    titles = ("Transmissibility of the body, multisine", "Transmissibility of the body, stepped sine")
    return [
        Curve(title=title, x_name="frequency, Hz", y_name="body / road", x=one.frequency_hz, y=np.abs(one.ratio))
        for title, one in zip(titles, found, strict=False)
    ]


def _histories(found: Ride) -> list[Curve]:
    shown = slice(None, min(found.time.size, round(8.0 / (found.time[1] - found.time[0]))))
    body, stroke = found.outputs["body_acceleration"][shown], "Force over velocity of the damper on the road"
    v, force = found.v[shown, 0], found.force[shown, 0]
    return [
        Curve(title="Body on the road", x_name="time, s", y_name="acceleration, m/s²", x=found.time[shown], y=body),
        Curve(title=stroke, x_name="velocity, m/s", y_name="force, N", x=v, y=force, style="markers"),
    ]
