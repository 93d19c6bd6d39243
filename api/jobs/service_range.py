"""The kind ``range``: service, training and rig in one chart, as `damper-rig study range` draws it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from api.errors import InputError
from api.jobs.kind import Kind, Progress, Task
from api.jobs.model_option import check_model
from api.jobs.run_choice import check_choice

if TYPE_CHECKING:
    from excitation import Envelope
    from identification.studies.service_range import Range

__all__ = ["RANGE", "RangeRequest"]


@dataclass(frozen=True, kw_only=True)
class RangeRequest:
    """Set the motion of the service, ``runs`` by their ids, beside that on which a model was ``trained`` (ids too), the
    stated range of a ``model``, and an ``envelope``: the keys of a rig's TOML file.

    Raises InputError, ModelError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["range"]
    runs: list[str]
    trained: list[str] = field(default_factory=list)
    model: dict[str, Any] | None = field(default=None, repr=False)  # any JSON: the model file's reader checks it
    envelope: dict[str, Any] | None = None  # any JSON: the envelope's own keys
    name: str = ""

    def __post_init__(self) -> None:
        check_choice(self)
        if not self.trained and self.model is None and self.envelope is None:
            raise InputError("nothing to compare the service with: give trained, a model or an envelope")
        if self.model is not None:
            check_model(self.model)
        _envelope(self.envelope)

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
    def held_out(self) -> list[str]:
        """The training runs: the second list that the process of a job is given."""
        return self.trained

    @property
    def title(self) -> str:
        return "service, training and rig"

    @property
    def options(self) -> dict[str, Any]:
        return {"model": self.model, "envelope": self.envelope}


def _envelope(keys: dict[str, Any] | None) -> Envelope | None:
    from excitation import Envelope
    from excitation.configuration import to_spec

    return None if keys is None else to_spec(Envelope, keys, "envelope")


def _found(task: Task) -> Range:
    from identification.measured import read_runs
    from identification.models import model_from_json
    from identification.studies.service_range import service_range

    given = task.request["model"]
    return service_range(
        read_runs(task.runs), read_runs(task.held_out) if task.held_out else (),
        model=None if given is None else model_from_json(given), envelope=_envelope(task.request["envelope"]),
    )  # fmt: skip


def _check(task: Task) -> None:
    _found(task)


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.studies.range_page import write_range
    from identification.studies.service_range import range_data

    tell(0.0, "reading")
    found = _found(task)
    data = range_data(found)
    (folder / "range.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_range(folder / "range.html", found)
    return data


RANGE = Kind(
    name="range",
    request=RangeRequest,
    files={"range.html": "text/html", "range.json": "application/json"},
    check=_check,
    run=_run,
)
