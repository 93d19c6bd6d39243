"""The kind ``complexity``: how complex a model must be, as `damper-rig study complexity` finds it."""

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
    from identification.models import SimulationModel
    from identification.physical.model import Model
    from identification.studies.complexity import Plan

__all__ = ["COMPLEXITY", "ComplexityRequest"]

_MOST_MODELS = 20


@dataclass(frozen=True, kw_only=True)
class ComplexityRequest:
    """Find what each element of a physical ``model`` is worth at each step of a validation ``plan``.

    ``plan``: the keys of a plan's TOML file: step, matters. ``exploration``: the ``exploration.json`` of an exploration
    whose feasible set states the uncertainty. ``beside``: models of any kind to set beside the ladder.

    Raises InputError, ModelError, DataError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["complexity"]
    model: dict[str, Any] = field(repr=False)  # any JSON: the model file's reader checks it
    plan: dict[str, Any]  # any JSON: the plan's own keys
    exploration: dict[str, Any] | None = field(default=None, repr=False)
    beside: list[dict[str, Any]] = field(default_factory=list, repr=False)
    name: str = ""
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)
        check_model(self.model)
        if len(self.beside) > _MOST_MODELS:
            raise InputError(f"beside has {len(self.beside)} entries: at most {_MOST_MODELS}")
        for k, model in enumerate(self.beside):
            check_model(model, where=f"beside.{k}")
        _plan(self.plan)
        _known(self.exploration)

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        return f"complexity of {model_name(self.model)}"

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model, "plan": self.plan, "exploration": self.exploration, "beside": self.beside}


def _plan(plan: dict[str, Any]) -> Plan:
    from excitation.configuration import to_spec
    from identification.studies.complexity import Plan

    return to_spec(Plan, plan, "plan")


def _known(exploration: dict[str, Any] | None) -> list[dict[str, float]]:
    from identification.studies.complexity.feasible import feasible_rows

    return [] if exploration is None else feasible_rows(exploration, "exploration")


def _models(task: Task) -> tuple[Model, list[SimulationModel]]:
    from identification.models import model_from_json
    from identification.physical.model import Model

    model = model_from_json(task.request["model"])
    if not isinstance(model, Model):
        raise InputError(f"model is of the kind {model.kind}: this study simplifies a physical model")
    return model, [model_from_json(one) for one in task.request["beside"]]


def _check(task: Task) -> None:
    from identification.measured import read_runs

    model, _ = _models(task)
    for step in _plan(task.request["plan"]).step:
        step.check(model)
    read_runs(task.runs, once=True)


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.measured import read_runs
    from identification.physical.modelfile import write_model
    from identification.studies.complexity import complexity, complexity_data, write_complexity

    (model, beside), plan = _models(task), _plan(task.request["plan"])
    found = complexity(
        model, read_runs(task.runs, once=True), plan.step, matters=plan.matters,
        feasible=_known(task.request["exploration"]), beside=beside, tell=tell,
    )  # fmt: skip
    data = complexity_data(found)
    (folder / "complexity.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_complexity(folder / "complexity.html", found)
    write_model(folder / "model.json", found.simplified)
    return {key: data[key] for key in ("indicators", "dropped", "knee")}


COMPLEXITY = Kind(
    name="complexity",
    request=ComplexityRequest,
    files={"complexity.html": "text/html", "complexity.json": "application/json", "model.json": "application/json"},
    check=_check,
    run=_run,
)
