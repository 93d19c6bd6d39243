"""Dampers in a vehicle in a notebook: `dr.study.vehicle(...)`, `dr.study.worth(...)`, `dr.study.realtime(...)`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.simulating import AnyModel, model_of
from excitation.configuration import to_spec
from identification.errors import ModelError
from identification.studies.realtime import realtime as timed
from identification.studies.realtime import realtime_data
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

__all__ = ["FmuWiring", "InVehicle", "OwnVehicle", "open_vehicle", "realtime", "vehicle", "worth"]


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


def realtime(
    model: AnyModel, step_s: float = 0.001, *, seconds: float = 10.0, current: float | None = None, paced: bool = False
) -> dict[str, Any]:
    """Measured time of each step of a model, s; the figures of `damper-rig study realtime --json`.

    Raises DataError and SimulationError, one line, where the model has no such step.
    """
    return realtime_data(timed(model_of(model), step_s, seconds=seconds, current=current, paced=paced))
