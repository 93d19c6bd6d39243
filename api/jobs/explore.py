"""The kind ``explore``: feasible parameters of a model, as `damper-rig study explore` finds them."""

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
    from identification.studies.exploration import Exploration
    from rigctl.runfile import Run

__all__ = ["EXPLORE", "ExploreRequest"]


@dataclass(frozen=True, kw_only=True)
class ExploreRequest:
    """Find the feasible parameters of a physical ``model`` over the sine tests of a campaign, of a rig, or ``runs``.

    ``study``: the keys of a study's TOML file: samples, low, high, sampling, seed, vary, points, limits.

    Raises InputError, ModelError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["explore"]
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
        return f"feasible parameters of {model_name(self.model)}"

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model, "study": self.study}


def _asked(study: dict[str, Any]) -> Exploration:
    from excitation.configuration import to_spec
    from identification.studies.exploration import Exploration

    return to_spec(Exploration, study, "study")


def _read(task: Task) -> tuple[Model, list[Run], Exploration]:
    from identification.measured import read_runs
    from identification.models import model_from_json
    from identification.physical.model import Model

    model = model_from_json(task.request["model"])
    if not isinstance(model, Model):
        raise InputError(f"model is of the kind {model.kind}: an exploration varies the parameters of a physical model")
    return model, read_runs((*task.runs, *task.held_out)), _asked(task.request["study"])


def _check(task: Task) -> None:
    from identification.studies.exploration import check_explorable

    check_explorable(*_read(task))


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.studies.exploration import explore, explored_data, write_explored

    found = explore(*_read(task), tell=tell)
    data = explored_data(found)
    (folder / "exploration.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_explored(folder / "exploration.html", found)
    return {key: data[key] for key in ("samples", "feasible", "binding_limit", "limits", "parameters")}


EXPLORE = Kind(
    name="explore",
    request=ExploreRequest,
    files={"exploration.html": "text/html", "exploration.json": "application/json"},
    check=_check,
    run=_run,
)
