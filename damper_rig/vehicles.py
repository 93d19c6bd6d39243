"""Dampers in a vehicle in a notebook: `dr.study.vehicle(...)`, `dr.study.worth(...)`, `dr.study.realtime(...)`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from excitation import Envelope
from excitation.configuration import to_spec
from identification.errors import ModelError
from identification.measured import check_runs
from identification.studies.range_page import write_range
from identification.studies.realtime import Realtime as Timed
from identification.studies.realtime import realtime as timed
from identification.studies.realtime import realtime_data, realtime_text
from identification.studies.realtime_page import write_realtime
from identification.studies.service_range import Range, range_data, range_text, service_range
from identification.studies.vehicle import (
    FmuWiring,
    OnOwn,
    OwnVehicle,
    Study,
    Vehicle,
    open_vehicle,
    own_study,
    setting_of,
    study_data,
    study_text,
    vehicle_study,
    write_study,
)
from identification.studies.vehicle import without as less
from identification.studies.vehicle import worth as worth_of
from rigctl.runfile import Run

__all__ = [
    "FmuWiring",
    "InRange",
    "InRealtime",
    "InVehicle",
    "OwnVehicle",
    "open_vehicle",
    "range_",
    "realtime",
    "vehicle",
    "worth",
]


@dataclass(frozen=True, slots=True)
class InVehicle:
    """The figures of dampers in a vehicle; ``study`` holds the curves, ``sentence`` what an effect is worth."""

    study: Study
    sentence: str = ""

    def data(self) -> dict[str, Any]:
        """What the command prints with `--json`, without the file."""
        return study_data(self.study)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_study(Path(path), self.study, self.sentence)
        return Path(path)

    def __repr__(self) -> str:
        return "\n".join(part for part in (study_text(self.study), self.sentence) if part)

    def _repr_html_(self) -> str:
        rows = [
            (one.label, figure.name, f"{figure.value:.4g} {figure.unit}".strip())
            for one in self.study.answers
            for figure in one.figures
        ]
        return paragraph(self.sentence or self.study.setting, strong=True) + table(("damper", "figure", "value"), rows)


def vehicle(
    models: Iterable[AnyModel],
    asked: Mapping[str, Any] | None = None,
    *,
    kind: str = "car",
    specimen: AnyModel | None = None,
    own: Vehicle | None = None,
) -> InVehicle:
    """Models of any kind in a vehicle: ``car``, ``seat`` or ``bogie``, or in your ``own``; ``asked``: the keys of the
    study's TOML. Your own is an `OwnVehicle` of Python functions, or an FMU by `open_vehicle`.

    Raises
    ------
    ModelError, DataError, DesignError
        One line, where a key or a vehicle is not known, or a model cannot be driven so.
    SimulationError
        Where the vehicle runs away.
    """
    loaded = [model_of(one) for one in models]
    if own is not None:
        given = to_spec(OnOwn, dict(asked or {}), "asked")
        with working("driving") as tell:
            return InVehicle(own_study(own, loaded, given, on_progress=tell))
    setting = setting_of(kind, dict(asked or {}), "asked")
    inside = None if specimen is None else model_of(specimen)
    with working("driving") as tell:
        return InVehicle(vehicle_study(loaded, setting, specimen=inside, on_progress=tell))


def worth(
    model: AnyModel,
    base: AnyModel | None = None,
    *,
    without: Sequence[str] = (),
    asked: Mapping[str, Any] | None = None,
    kind: str = "car",
) -> InVehicle:
    """What an effect is worth in a vehicle: the model against a ``base``, or ``without`` some of its elements.

    Raises as `vehicle` does; ModelError where neither a base nor elements are given, or both.
    """
    if (base is None) == (not without):
        raise ModelError("worth: give a base, or the elements that it is without")
    found = model_of(model)
    bare = model_of(base) if base is not None else less(found, without)
    setting, effect = setting_of(kind, dict(asked or {}), "asked"), " and ".join(without) or "what the base lacks"
    with working("driving") as tell:
        answered = worth_of(
            found, bare, lambda both: vehicle_study(both, setting, specimen=found, on_progress=tell), effect
        )
    return InVehicle(answered.study, answered.sentence)


@dataclass(frozen=True, slots=True)
class InRealtime:
    """A model against the clock; ``result`` holds every step. A figure of `data` by its name: ``found["worst"]``."""

    result: Timed

    def data(self) -> dict[str, Any]:
        """What `damper-rig study realtime --json` prints."""
        return realtime_data(self.result)

    def __getitem__(self, name: str) -> Any:
        return self.data()[name]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_realtime(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return realtime_text(self.result)

    def _repr_html_(self) -> str:
        return paragraph(realtime_text(self.result))


def realtime(
    model: AnyModel,
    step_s: float = 0.001,
    *,
    seconds: float = 10.0,
    stroke_m: float = 0.01,
    current: float | None = None,
    seed: int = 1,
    paced: bool = False,
) -> InRealtime:
    """Measured time of each step of a model, s, and what a momentary bad input does.

    Raises DataError and SimulationError, one line, where the model has no such step.
    """
    loaded = model_of(model)
    return InRealtime(
        timed(loaded, step_s, seconds=seconds, stroke_m=stroke_m, current=current, seed=seed, paced=paced)
    )


@dataclass(frozen=True, slots=True)
class InRange:
    """The stroke–velocity chart of service, training and rig; ``result`` holds the motions."""

    result: Range

    def data(self) -> dict[str, Any]:
        """What `damper-rig study range --json` prints, without the file."""
        return range_data(self.result)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_range(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return range_text(self.result)

    def _repr_html_(self) -> str:
        return paragraph(range_text(self.result))


def range_(
    service: Run | Iterable[Run],
    trained: Run | Iterable[Run] = (),
    *,
    model: AnyModel | None = None,
    envelope: Envelope | None = None,
) -> InRange:
    """Which share of the service lies outside of what a model was trained on, and of what a rig can do.

    Raises DataError, one line, where a run does not move or there is nothing to compare with.
    """
    driven, learned = listed(service), listed(trained)
    check_runs(driven)
    check_runs(learned)
    known = None if model is None else model_of(model)
    return InRange(service_range(driven, learned, model=known, envelope=envelope))
