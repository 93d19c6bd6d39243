"""The kind ``sensitivity``: what each parameter does to the force, as `damper-rig study sensitivity` finds it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from identification.physical.model import Model
    from identification.studies.sensitivity import Sensitivity

__all__ = ["SENSITIVITY", "SensitivityRequest"]


@dataclass(frozen=True, kw_only=True)
class SensitivityRequest:
    """How much each parameter of a physical ``model`` changes its force, at the operating point of the first sine test.

    ``study``: the keys of a study's TOML file: vary, levels, hidden, trained, networks, base_samples, seed.

    Raises InputError, ModelError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["sensitivity"]
    model: dict[str, Any] = field(repr=False)  # any JSON: the model file's reader checks it
    study: dict[str, Any] = field(default_factory=dict)  # any JSON: the study's own keys
    name: str = ""
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)
        check_model(self.model)
        _asked(self.study)

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        return f"sensitivity of {model_name(self.model)}"

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model, "study": self.study}


def _asked(study: dict[str, Any]) -> Sensitivity:
    from excitation.configuration import to_spec
    from identification.studies.sensitivity import Sensitivity

    return to_spec(Sensitivity, study, "study")


def _read(task: Task) -> tuple[Model, Sensitivity]:
    from identification.measured import read_runs
    from identification.models import model_from_json
    from identification.physical.model import Model
    from identification.studies.sensitivity import at_run

    model = model_from_json(task.request["model"])
    if not isinstance(model, Model):
        raise InputError(f"model is of the kind {model.kind}: this study varies the parameters of a physical model")
    return model, at_run(_asked(task.request["study"]), read_runs((*task.runs, *task.held_out)))


def _check(task: Task) -> None:
    from identification.studies.sensitivity import check_sensitivity

    check_sensitivity(*_read(task))


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.studies.sensitivity import sensitivity, sensitivity_data, write_sensitivity

    found = sensitivity(*_read(task), tell=tell)
    data = sensitivity_data(found)
    (folder / "sensitivity.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_sensitivity(folder / "sensitivity.html", found)
    return {key: data[key] for key in ("samples", "parameters", "orders")}


SENSITIVITY = Kind(
    name="sensitivity",
    request=SensitivityRequest,
    files={"sensitivity.html": "text/html", "sensitivity.json": "application/json"},
    check=_check,
    run=_run,
)
