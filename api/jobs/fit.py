"""The kind ``fit``: the free parameters of a physical model from measured runs, as `damper-rig fit` finds them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import StrictBool, StrictFloat, StrictInt

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from identification.physical.model import Model
    from rigctl.runfile import Run

__all__ = ["FIT", "FitRequest"]

_MOST_STARTS = 100


@dataclass(frozen=True, kw_only=True)
class FitRequest:
    """Fit the free parameters of a model to the training runs of a campaign, of a rig, or to ``runs`` by their ids.

    ``starts``: number of starts; the best fit is kept. ``robust``: the Huber threshold, in noise standard deviations.
    ``refine``: fit smooth forms of friction and hysteresis where the runs show them.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["fit"]
    model: dict[str, Any] = field(repr=False)  # any JSON: the model file's reader checks it
    name: str = ""
    starts: StrictInt = 1
    robust: StrictFloat | None = None
    refine: StrictBool = False
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)
        if not 1 <= self.starts <= _MOST_STARTS:
            raise InputError(f"starts is {self.starts}: it must lie in 1 … {_MOST_STARTS}")
        if self.robust is not None and not self.robust > 0.0:
            raise InputError(f"robust is {self.robust:g}: it must be above 0 noise standard deviations")
        check_model(self.model)

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        return f"fit of {model_name(self.model)}"

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model, "starts": self.starts, "robust": self.robust, "refine": self.refine}


def _check(task: Task) -> None:
    from identification.fitting.admission import admit
    from identification.models.simulation import check_inputs
    from identification.record import record_from_run

    model, runs = _read(task)
    for run in runs:
        check_inputs(model, run)
    admit(model, [record_from_run(run) for run in runs])


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.fitting import fit, moved_far, warnings
    from identification.physical.modelfile import write_model

    start, runs = _read(task)
    result = fit(
        start,
        runs,
        starts=task.request["starts"],
        robust=task.request["robust"],
        refine=task.request["refine"],
        on_step=lambda step, cost: tell(1 - 0.8**step, f"fitting, step {step}"),
    )
    write_model(folder / "model.json", result.model)
    return {
        "gap_n": result.rms,
        "converged": result.converged,
        "reason": result.reason,
        "iterations": result.iterations,
        "warnings": [*warnings(result), *moved_far(start, result.model)],
    }


def _read(task: Task) -> tuple[Model, list[Run]]:
    from identification.measured import read_runs
    from identification.models import model_from_json
    from identification.physical.model import Model

    model = model_from_json(task.request["model"], only=("physical",))
    assert isinstance(model, Model)  # by `only`
    return model, read_runs(task.runs, once=True)


FIT = Kind(name="fit", request=FitRequest, files={"model.json": "application/json"}, check=_check, run=_run)
