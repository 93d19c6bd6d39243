"""What periodic tests say before any model."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import listed
from excitation.analysis import Analysis
from identification.analysis import (
    AtLevel,
    LevelsFound,
    analyse_levels,
    levels_data,
    levels_text,
    refused_text,
    write_analysis,
)
from identification.errors import DataError
from identification.measured import check_runs
from rigctl.runfile import Run

__all__ = ["Analysed", "analyse"]


@dataclass(frozen=True, slots=True)
class Analysed:
    """Best linear approximation, distortion, noise and change over time of each design and level among the runs."""

    found: LevelsFound

    @property
    def levels(self) -> tuple[AtLevel, ...]:
        """The levels that are known; ``found.refused`` are those that are not, each with its reason."""
        return self.found.levels

    @property
    def result(self) -> Analysis:
        """The arrays of the only level; raises DataError where there are several, each with its own in ``levels``."""
        if len(self.levels) > 1:
            raise DataError(f"{len(self.levels)} levels have been analysed: take one of levels, with its found")
        return self.levels[0].found

    def data(self) -> dict[str, Any]:
        """What `damper-rig analyse --json` prints, without the file."""
        return levels_data(self.found)

    def rows(self) -> list[dict[str, Any]]:
        """The parts of the force, a dictionary each: name, rms and bounds, N; the level where there are several."""
        data = self.data()
        if "levels" not in data:
            return self._rows(data["force"])
        told = zip(self.levels, data["levels"], strict=True)
        return [{"level": one.setting.text, **row} for one, found in told for row in self._rows(found["force"])]

    @staticmethod
    def _rows(force: dict[str, Any]) -> list[dict[str, Any]]:
        whole = [{"part": name, "rms": force[name], "low": None, "high": None} for name in ("rms", "linear")]
        parts = ("odd", "even", "nonlinear", "noise", "time_variation")
        known = [(name, force[name]) for name in parts if force[name] is not None]
        return whole + [{"part": name, **{key: one[key] for key in ("rms", "low", "high")}} for name, one in known]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_analysis(Path(path), self.found)
        return Path(path)

    def __repr__(self) -> str:
        return levels_text(self.found)

    def _repr_html_(self) -> str:
        cells = [[_cell(value) for value in row.values()] for row in self.rows()]
        level = () if self.found.alone else ("level",)
        heads = (*level, "part of the force", "N rms", "from", "to")
        notes = [note for one in self.levels for note in one.found.notes]
        return table(heads, cells) + "".join(map(paragraph, (*notes, *map(refused_text, self.found.refused))))


def _cell(value: str | float | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.4g}"


def analyse(runs: Run | Iterable[Run]) -> Analysed:
    """Linear part, odd and even distortion, noise and change over time of periodic runs, each level by itself.

    Raises
    ------
    DataError, AnalysisError
        Where the runs do not go together, do not repeat, or tell nothing.
    """
    measured = listed(runs)
    check_runs(measured, once=True)
    with working("analysing"):
        return Analysed(analyse_levels(measured))
