"""Semi-active dampers in the seat suspension: skyhook control through the inverse of each model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT
from identification.errors import DataError
from identification.models.protocol import SimulationModel
from identification.physical.new_model import model_of_family
from identification.studies.pace import silent
from identification.studies.vehicle import grounds
from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, labels_of
from identification.studies.vehicle.comfort import comfort
from identification.studies.vehicle.parts import Part, rides
from identification.studies.vehicle.protocol import Ground
from identification.studies.vehicle.ride import Control, Held, Ride, check_dampers
from identification.studies.vehicle.road_study import PLACE, notes_of
from identification.studies.vehicle.seat import PASSIVE_N_S_PER_M, Seat, seat_suspension
from identification.studies.vehicle.skyhook import Skyhook
from identification.studies.vehicle.step import step_for
from identification.studies.vehicle.transmissibility import Transmissibility, by_sines, sine_parts

Tell = Callable[[float, str], None]
Floats = NDArray[np.float64]

PASSIVE = "passive"
_NO_DAMPER = 1e-9  # N·s/m: a family of dampers begins above 0
_SHOWN_S = 0.1  # between two currents that are drawn, as in the paper's figure
_PERIOD_S = 5.0  # of the random excitation
SINES_HZ = tuple(float(f) for f in np.arange(1.0, 9.01, 0.5))


@dataclass(frozen=True, slots=True, kw_only=True)
class OnSeat:
    """A seat on a floor that moves by sines of one amplitude, and at random from 1 to 10 Hz.

    `sky_n_s_per_m` is the skyhook's damping, `lowest` … `highest` the currents, A, `period_s` between two of them.
    The amplitude decides how much a damper with a yield force moves at all: half or double changes every ratio.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    seat: Seat = field(default_factory=Seat)
    sky_n_s_per_m: float = 2000.0
    passive_n_s_per_m: float = PASSIVE_N_S_PER_M  # of the damper that the others are compared with
    lowest: float = 0.0
    highest: float = 1.0
    period_s: float = 0.005
    amplitude_m: float = 0.005
    sines_hz: tuple[float, ...] = SINES_HZ
    random_rms_m: float = 0.006
    seed: int = 1
    step_s: float | None = None


def seat_study(
    models: Sequence[SimulationModel],
    given: OnSeat | None = None,
    *,
    specimen: SimulationModel | None = None,
    on_progress: Tell | None = None,
) -> Study:
    """The passive seat, then the seat controlled through every model in turn.

    The damper in the seat is the model itself, or `specimen` for all of them: then the models differ only in the
    inverse by which the current is looked up, as they do in a real seat.

    Raises
    ------
    DataError
        before the work, one line: a model without a current, steps that do not agree.
    SimulationError
        as `ride` does.
    """
    given = given or OnSeat()
    dt, hooks = check_seat_study(models, given, specimen)
    passive = replace(model_of_family("linear", max(given.passive_n_s_per_m, _NO_DAMPER), 1.0), name=PASSIVE)
    cases: list[tuple[SimulationModel, Control]] = [(passive, Held(0.0))]
    cases += [(specimen or model, hook) for model, hook in zip(models, hooks, strict=True)]
    labels = labels_of([PASSIVE, *(model.name for model in models)])
    parts = [_parts(damper, control, given, dt) for damper, control in cases]
    found = rides([part for own in parts for part in own], on_progress or silent, "dampers in the seat")
    answers, at = [], 0
    for label, (damper, _), own in zip(labels, cases, parts, strict=True):
        answers.append(_answer(label, damper, given, own, found[at : at + len(own)]))
        at += len(own)
    answers = [_beside(one, answers[0]) for one in answers]
    setting = (
        f"Seat suspension, skyhook of {given.sky_n_s_per_m:g} N·s/m, sines of {1e3 * given.amplitude_m:g} mm, "
        f"random motion of {1e3 * given.random_rms_m:g} mm rms, 1 … 10 Hz; "
        + (f"the damper is '{specimen.name}'" if specimen else "each damper is the model of its own inverse")
    )
    return Study(title="Dampers in the seat suspension", setting=setting, answers=tuple(answers), facts=asdict(given))


def check_seat_study(
    models: Sequence[SimulationModel], given: OnSeat, specimen: SimulationModel | None = None
) -> tuple[float, list[Skyhook]]:
    """The step, s, and the control through every model; raises DataError, one line, where the study cannot begin."""
    if not models:
        raise DataError("no model is given: a study compares one or more")
    dt = step_for([*models, *([specimen] if specimen else [])], given.step_s)
    hooks = [_skyhook(model, given) for model in models]
    vehicle, floor = seat_suspension(given.seat), random_floor(given, dt)
    for damper, hook in zip([specimen or model for model in models], hooks, strict=True):
        check_dampers(vehicle, {PLACE: damper}, floor, hook)
    return dt, hooks


def _skyhook(model: SimulationModel, given: OnSeat) -> Skyhook:
    return Skyhook(
        inverse=model,
        sky_n_s_per_m=given.sky_n_s_per_m,
        lowest=given.lowest,
        highest=given.highest,
        period_s=given.period_s,
    )


def _parts(damper: SimulationModel, control: Control, given: OnSeat, dt: float) -> list[Part]:
    """The ride on the random floor, then those over the sines."""
    vehicle, dampers = seat_suspension(given.seat), {PLACE: damper}
    floor = Part(vehicle=vehicle, dampers=dampers, ground=random_floor(given, dt), control=control)
    return [floor, *sine_parts(vehicle, dampers, given.sines_hz, given.amplitude_m, dt, control)]


def _answer(
    label: str, damper: SimulationModel, given: OnSeat, parts: Sequence[Part], rides_of: Sequence[Ride]
) -> Answer:
    found, dt = rides_of[0], parts[0].ground.dt
    seat = by_sines(rides_of[1:], parts[1:], "seat", given.sines_hz)
    late = slice(round(_PERIOD_S / dt), None)
    felt = comfort(found.outputs["passenger_acceleration"], 1.0 / dt, settle_s=_PERIOD_S)
    peak_hz, peak = seat.peak
    figures = (
        Figure(name="peak of the seat's transmissibility", unit="", value=peak),
        Figure(name="frequency of the peak", unit="Hz", value=peak_hz),
        Figure(name="rms of the seat's acceleration", unit="m/s²",
               value=float(np.std(found.outputs["seat_acceleration"][late]))),
        Figure(name="passenger's weighted acceleration a_w (Wk)", unit="m/s²", value=felt.rms),
        Figure(name="mean current", unit="A", value=float(np.mean(found.current[late, 0]))),
        Figure(name="rms of the stroke", unit="m", value=float(np.std(found.x[late, 0]))),
    )  # fmt: skip
    time = found.time[late] - found.time[late][0]
    every = max(1, round(_SHOWN_S / dt))
    curves = [
        _transmissibility(seat),
        Curve(title="Seat on the random floor", x_name="time, s", y_name="acceleration, m/s²",
              x=time, y=found.outputs["seat_acceleration"][late]),
        Curve(title="Control current, every 0.1 s", x_name="time, s", y_name="current, A", style="steps",
              x=time[::every], y=found.current[late, 0][::every]),
    ]  # fmt: skip
    return Answer(label=label, figures=figures, curves=tuple(curves), notes=notes_of(damper, found))


def random_floor(given: OnSeat, dt: float) -> Ground:
    """Two periods of a multisine from 1 to 10 Hz: the second is looked at."""
    multitone = grounds.tones(1.0, 10.0, given.random_rms_m, _PERIOD_S, dt, given.seed)
    return grounds.multisine(multitone, 2, dt)


def _transmissibility(found: Transmissibility) -> Curve:
    return Curve(
        title="Transmissibility of the seat, stepped sine",
        x_name="frequency, Hz",
        y_name="seat / floor",
        x=found.frequency_hz,
        y=np.abs(found.ratio),
    )


def _beside(one: Answer, passive: Answer) -> Answer:
    """With the transmissibility where the passive seat has its peak."""
    curve, reference = one.curves[0], passive.curves[0]
    k = int(np.argmax(reference.y))
    name = f"transmissibility at the passive peak ({reference.x[k]:g} Hz)"
    at = Figure(name=name, unit="", value=float(curve.y[k]))
    less = Figure(name="less than passive there by", unit="", value=float(reference.y[k] - curve.y[k]))
    return replace(one, figures=(*one.figures, at, less))
