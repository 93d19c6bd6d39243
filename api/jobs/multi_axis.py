"""The kind ``multi_axis``: excitations of rigs of several axes, as `damper-rig design multi-axis` designs them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from api.campaigns.texts import check_text
from api.jobs.kind import Kind, Progress, Task

if TYPE_CHECKING:
    from excitation.multi_axis import MultiAxisSpec

__all__ = ["MULTI_AXIS", "MultiAxisRequest"]


@dataclass(frozen=True, kw_only=True)
class MultiAxisRequest:
    """Design multisines of up to six axes. ``design``: the keys of the command's TOML file. It needs no runs.

    Raises InputError or DesignError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    kind: Literal["multi_axis"]
    design: dict[str, Any] = field(repr=False)  # any JSON: excitation checks it
    name: str = ""

    def __post_init__(self) -> None:
        if self.name:
            check_text("name", self.name, 200)
        _spec(self.design)

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
        return f"multisines of {', '.join(axis.name for axis in _spec(self.design).axes)}"[:200]

    @property
    def options(self) -> dict[str, Any]:
        return {"design": self.design}


def _spec(design: dict[str, Any]) -> MultiAxisSpec:
    from excitation.configuration import to_spec
    from excitation.multi_axis import MultiAxisSpec

    return to_spec(MultiAxisSpec, design, "design")


def _check(task: Task) -> None:
    from excitation.multi_axis import multi_axis

    multi_axis(_spec(task.request["design"]))


def _run(task: Task, folder: Path, tell: Progress) -> dict[str, Any]:
    from excitation.multi_axis import multi_axis
    from excitation.multi_axis_file import multi_axis_facts, write_multi_axis

    made = multi_axis(_spec(task.request["design"]))
    tell(0.5, "writing")
    write_multi_axis(folder / "axes.h5", made)
    return multi_axis_facts(made.spec)


MULTI_AXIS = Kind(
    name="multi_axis",
    request=MultiAxisRequest,
    files={"axes.h5": "application/x-hdf5"},
    check=_check,
    run=_run,
)
