"""The kind ``explain``: what the simulation is missing, as `damper-rig explain` finds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import StrictBool

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model, model_name
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from identification.physical.model import Model
    from rigctl.runfile import Run

__all__ = ["EXPLAIN", "ExplainRequest"]


@dataclass(frozen=True, kw_only=True)
class ExplainRequest:
    """Name what a model is missing, from the runs of one specimen.

    The runs are those of a ``campaign``, all complete ones of a ``rig`` (of one ``specimen``, where it is given), or
    ``runs`` and ``held_out`` by their ids. ``simulated``: no model; the runs contain a channel force_simulated.

    Raises InputError or ModelError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["explain"] = "explain"
    name: str = ""
    model: dict[str, Any] | None = field(default=None, repr=False)  # any JSON: the model file's reader checks it
    simulated: StrictBool = False
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)
    held_out: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)
        if self.simulated == (self.model is not None):
            raise InputError("give either a model, or simulated: true where the runs contain a channel force_simulated")
        if self.model is not None:
            check_model(self.model)

    @property
    def title(self) -> str:
        return "the given simulation" if self.model is None else model_name(self.model)

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model}


def _check(task: Task) -> None:
    from identification.discrepancy import prepared

    model, runs, held_out = _read(task)
    prepared(model, runs, held_out)


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.discrepancy import explain, report_data, write_report

    model, runs, held_out = _read(task)
    found = explain(model, runs, held_out, on_progress=lambda text, done: tell(done, text))
    write_report(found, folder, reproduce=_command(task.request), runs=[*runs, *(held_out or [])])
    report = report_data(found)
    return {"verdict": report["verdict"], "effects": [[e["element"], e["confidence"]] for e in report["effects"]]}


def _read(task: Task) -> tuple[Model | None, Sequence[Run], Sequence[Run] | None]:
    from identification.discrepancy.foreign import as_base
    from identification.measured import read_runs
    from identification.models import model_from_json

    every = read_runs((*task.runs, *task.held_out), once=True)
    runs, held_out = every[: len(task.runs)], every[len(task.runs) :]
    if task.request["model"] is None:
        return None, runs, held_out or None
    model, driven = as_base(model_from_json(task.request["model"]), [*runs, *held_out])
    return model, driven[: len(runs)], driven[len(runs) :] or None


def _command(request: Mapping[str, Any]) -> str:
    """The command that repeats the explanation with the files of the service."""
    runs, held_out = (" ".join(f"{name}.h5" for name in request[key]) for key in ("runs", "held_out"))
    model = "--simulated" if request["model"] is None else "MODEL.json"
    return f"damper-rig explain {model} {runs}{f' --held-out {held_out}' if held_out else ''} -o report"


EXPLAIN = Kind(
    name="explain",
    request=ExplainRequest,
    files={
        "report.json": "application/json",
        "report.html": "text/html",
        "model.json": "application/json",
        "evidence.h5": "application/x-hdf5",
    },
    check=_check,
    run=_run,
)
