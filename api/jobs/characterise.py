"""The kind ``characterise``: the characteristic sheet of a damper, as `damper-rig characterise` writes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Literal

from api.jobs.kind import Kind, Progress, Task
from api.jobs.run_choice import check_choice

__all__ = ["CHARACTERISE", "CharacteriseRequest"]


@dataclass(frozen=True, kw_only=True)
class CharacteriseRequest:
    """Draw the characteristic sheet of the sine tests of a campaign, of a rig, or of ``runs`` by their ids.

    Raises InputError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["characterise"]
    name: str = ""
    campaign: str = ""
    rig: str = ""
    specimen: str = ""
    runs: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_choice(self)

    @property
    def held_out(self) -> list[str]:
        return []

    @property
    def title(self) -> str:
        return "characteristic sheet"

    @property
    def options(self) -> dict[str, Any]:
        return {}


def _check(task: Task) -> None:
    from identification.errors import DataError
    from identification.measured import read_runs
    from identification.steady import steady_cycles

    if not any(map(steady_cycles, read_runs((*task.runs, *task.held_out)))):
        raise DataError("no run is a steady sine: the sheet needs whole cycles of a sine and a force that varies")


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.measured import read_runs
    from identification.sheet import sheet_of, sheet_to_json, write_sheet

    runs = read_runs((*task.runs, *task.held_out))  # nothing is fitted: held-out runs are drawn too
    tell(0.5, "drawing")
    sheet = sheet_of(runs)
    write_sheet(folder / "sheet.html", sheet)
    return sheet_to_json(sheet)


CHARACTERISE = Kind(
    name="characterise", request=CharacteriseRequest, files={"sheet.html": "text/html"}, check=_check, run=_run
)
