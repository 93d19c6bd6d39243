"""The kind ``realtime``: a model against the clock of this service, as `damper-rig study realtime` measures it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import StrictBool, StrictFloat, StrictInt

from api.campaigns.texts import check_text
from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name

if TYPE_CHECKING:
    from identification.models import SimulationModel

__all__ = ["REALTIME", "RealtimeRequest"]

_LONGEST_S = 600.0


@dataclass(frozen=True, kw_only=True)
class RealtimeRequest:
    """Step a ``model`` of any kind along a random motion of ``seconds`` and measure each step. It needs no runs.

    ``step``, s; ``stroke``: peak of the motion, m; ``current``, A, by default the middle of the training; ``paced``:
    wait for the time of each step.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["realtime"]
    model: dict[str, Any] = field(repr=False)  # any JSON: the model file's reader checks it
    step: StrictFloat = 0.001
    seconds: StrictFloat = 10.0
    stroke: StrictFloat = 0.01
    current: StrictFloat | None = None
    seed: StrictInt = 1
    paced: StrictBool = False
    name: str = ""

    def __post_init__(self) -> None:
        if self.name:
            check_text("name", self.name, 200)
        if not 0.5 <= self.seconds <= _LONGEST_S:
            raise InputError(f"seconds is {self.seconds:g}: it must lie within [0.5, {_LONGEST_S:g}]")
        if self.seed < 0:
            raise InputError(f"seed is {self.seed}: it must be 0 or more")
        check_model(self.model)

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
        return f"{model_name(self.model)} in real time"

    @property
    def options(self) -> dict[str, Any]:
        names = ("model", "step", "seconds", "stroke", "current", "seed", "paced")
        return {name: getattr(self, name) for name in names}


def _read(task: Task) -> tuple[SimulationModel, float, dict[str, Any]]:
    """The model, its step, and the rest. Any: JSON."""
    from identification.models import model_from_json

    given = task.request
    rest = {"seconds": given["seconds"], "stroke_m": given["stroke"], "current": given["current"]}
    return model_from_json(given["model"]), given["step"], rest


def _check(task: Task) -> None:
    from identification.studies.realtime import check_realtime

    model, step, rest = _read(task)
    check_realtime(model, step, **rest)


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.studies.realtime import realtime, realtime_data
    from identification.studies.realtime_page import write_realtime

    model, step, rest = _read(task)
    found = realtime(model, step, **rest, seed=task.request["seed"], paced=task.request["paced"], on_progress=tell)
    data = realtime_data(found)
    (folder / "realtime.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_realtime(folder / "realtime.html", found)
    return data


REALTIME = Kind(
    name="realtime",
    request=RealtimeRequest,
    files={"realtime.html": "text/html", "realtime.json": "application/json"},
    check=_check,
    run=_run,
)
