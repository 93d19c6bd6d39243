"""The kind ``analyse``: linear part, distortion and noise of periodic tests, as `damper-rig analyse` finds them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Literal

from api.jobs.kind import Kind, Progress, Task
from api.jobs.run_choice import check_choice

__all__ = ["ANALYSE", "AnalyseRequest"]


@dataclass(frozen=True, kw_only=True)
class AnalyseRequest:
    """Best linear approximation, odd and even distortion, noise and change over time of ``runs`` by their ids, of a
    campaign, or of a rig. All must be periodic; each design and level is analysed by itself.

    Raises InputError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["analyse"]
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
        return "linear part and distortion"

    @property
    def options(self) -> dict[str, Any]:
        return {}


def _check(task: Task) -> None:
    from identification.analysis import analyse_levels
    from identification.measured import read_runs

    analyse_levels(read_runs((*task.runs, *task.held_out), once=True))  # as quick as any part of it


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from identification.analysis import analyse_levels, levels_data, write_analysis
    from identification.measured import read_runs

    found = analyse_levels(read_runs((*task.runs, *task.held_out), once=True))  # held-out runs too: nothing is fitted
    tell(0.5, "drawing")
    data = levels_data(found)
    (folder / "analysis.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    write_analysis(folder / "analysis.html", found)
    if "levels" not in data:
        return {key: data[key] for key in _TOLD}
    return {"levels": [{key: one[key] for key in _TOLD} for one in data["levels"]], "refused": data["refused"]}


_TOLD = ("runs", "level", "band", "method", "force", "notes")


ANALYSE = Kind(
    name="analyse",
    request=AnalyseRequest,
    files={"analysis.html": "text/html", "analysis.json": "application/json"},
    check=_check,
    run=_run,
)
