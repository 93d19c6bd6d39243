"""The kind ``vehicle``: damper models in a vehicle, as `damper-rig study vehicle`, `seat` and `bogie` study them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from api.campaigns.texts import check_text
from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name

if TYPE_CHECKING:
    from identification.models import SimulationModel
    from identification.studies.vehicle.choice import Setting

__all__ = ["VEHICLE", "VehicleRequest"]

_MOST_MODELS = 20


@dataclass(frozen=True, kw_only=True)
class VehicleRequest:
    """Drive every one of ``models`` in the ``vehicle``: car, seat or bogie. It needs no runs.

    ``study``: the keys of a study's TOML file. With ``without`` the one model is compared with itself less these
    elements, by their ids: what they are worth in the vehicle.

    Raises InputError, ModelError, DataError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["vehicle"]
    models: list[dict[str, Any]] = field(repr=False)  # any JSON: the model file's reader checks it
    vehicle: str = "car"
    study: dict[str, Any] = field(default_factory=dict)  # any JSON: the study's own keys
    without: list[str] = field(default_factory=list)
    name: str = ""

    def __post_init__(self) -> None:
        if self.name:
            check_text("name", self.name, 200)
        if not 1 <= len(self.models) <= _MOST_MODELS:
            raise InputError(f"models has {len(self.models)} entries: 1 … {_MOST_MODELS} can be studied")
        if self.without and len(self.models) != 1:
            raise InputError(f"without goes with one model: models has {len(self.models)}")
        for k, model in enumerate(self.models):
            check_model(model, where=f"models.{k}")
        _setting(self.options)

    @property
    def campaign(self) -> str:
        return ""

    @property
    def rig(self) -> str:
        return ""

    @property
    def specimen(self) -> str:
        return ""

    @property
    def runs(self) -> list[str]:
        return []

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        what = model_name(self.models[0]) if len(self.models) == 1 else f"{len(self.models)} models"
        return f"{what} in the {self.vehicle}"

    @property
    def options(self) -> dict[str, Any]:
        return {"models": self.models, "vehicle": self.vehicle, "study": self.study, "without": self.without}


def _setting(request: dict[str, Any]) -> Setting:
    from identification.studies.vehicle import setting_of

    return setting_of(request["vehicle"], request["study"], "study")


def _read(task: Task) -> tuple[list[SimulationModel], Setting]:
    from identification.models import model_from_json
    from identification.studies.vehicle import without

    models = [model_from_json(model) for model in task.request["models"]]
    if task.request["without"]:
        models.append(without(models[0], task.request["without"]))
    return models, _setting(dict(task.request))


def _check(task: Task) -> None:
    from identification.studies.vehicle import check_vehicle_study

    check_vehicle_study(*_read(task))


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.studies.vehicle import Worth, study_data, vehicle_study, worth, write_study

    models, setting = _read(task)
    effects = task.request["without"]
    note = ""
    if effects:
        found: Worth = worth(
            models[0],
            models[1],
            lambda both: vehicle_study(both, setting, specimen=models[0], on_progress=tell),
            " and ".join(effects),
        )
        study, note = found.study, found.sentence
    else:
        study = vehicle_study(models, setting, on_progress=tell)
    data = study_data(study) | ({"worth": note} if note else {})
    (folder / "study.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_study(folder / "study.html", study, note)
    return {key: data[key] for key in ("setting", "answers", "worth") if key in data}


VEHICLE = Kind(
    name="vehicle",
    request=VehicleRequest,
    files={"study.html": "text/html", "study.json": "application/json"},
    check=_check,
    run=_run,
)
