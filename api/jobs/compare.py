"""The kind ``compare``: models of any kind on measured runs, as `damper-rig compare` compares them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import StrictFloat

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from identification.models import SimulationModel
    from rigctl.runfile import Run

__all__ = ["COMPARE", "CompareRequest"]

_MOST_MODELS = 50


@dataclass(frozen=True, kw_only=True)
class CompareRequest:
    """Simulate every one of ``models`` along every run of a campaign, of a rig, or along ``runs`` by their ids.

    Held-out runs are compared too: nothing is fitted. ``rate_hz``: all runs are resampled to it first.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["compare"]
    models: list[dict[str, Any]] = field(repr=False)  # any JSON: the model file's reader checks it
    name: str = ""
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)
    rate_hz: StrictFloat | None = None

    def __post_init__(self) -> None:
        check_choice(self)
        if not 1 <= len(self.models) <= _MOST_MODELS:
            raise InputError(f"models has {len(self.models)} entries: 1 … {_MOST_MODELS} can be compared")
        for k, model in enumerate(self.models):
            check_model(model, where=f"models.{k}", of_axes=True)
        if self.rate_hz is not None and not (isfinite(self.rate_hz) and self.rate_hz > 0.0):
            raise InputError(f"rate_hz is {self.rate_hz:g}: it must be above 0 Hz")

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        return "comparison of " + (
            model_name(self.models[0]) if len(self.models) == 1 else f"{len(self.models)} models"
        )

    @property
    def options(self) -> dict[str, Any]:
        return {"models": self.models, "rate_hz": self.rate_hz}


def _check(task: Task) -> None:
    from identification.models.compare import check_comparison

    check_comparison(*_read(task))


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.models import compare, comparison_data
    from identification.models.comparison_page import write_comparison

    found = compare(*_read(task), on_progress=tell)
    data = comparison_data(found)
    (folder / "comparison.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_comparison(folder / "comparison.html", found)
    return {"models": [{key: row[key] for key in ("model", "rms", "fit", "eearth")} for row in data["models"]]}


def _read(task: Task) -> tuple[Sequence[SimulationModel], Sequence[Run]]:
    from identification.blackbox import resampled
    from identification.measured import read_runs
    from identification.models import KINDS, model_from_json
    from identification.multiaxis import MAIN_FORCE

    models = [model_from_json(model, kinds=(*KINDS, MAIN_FORCE)) for model in task.request["models"]]
    runs, rate_hz = read_runs((*task.runs, *task.held_out)), task.request.get("rate_hz")
    return models, [one if rate_hz is None else resampled(one, rate_hz) for one in runs]


COMPARE = Kind(
    name="compare",
    request=CompareRequest,
    files={"comparison.html": "text/html", "comparison.json": "application/json"},
    check=_check,
    run=_run,
)
