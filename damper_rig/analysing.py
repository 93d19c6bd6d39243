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
from identification.analysis import analyse_runs, analysis_data, analysis_text, write_analysis
from identification.measured import check_runs
from rigctl.runfile import Run

__all__ = ["Analysed", "analyse"]


@dataclass(frozen=True, slots=True)
class Analysed:
    """Best linear approximation, distortion, noise and change over time; ``result`` holds them as arrays."""

    result: Analysis

    def data(self) -> dict[str, Any]:
        """What `damper-rig analyse --json` prints, without the file."""
        return analysis_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The parts of the force, a dictionary each: name, rms and bounds, N."""
        force = self.data()["force"]
        whole = [{"part": name, "rms": force[name], "low": None, "high": None} for name in ("rms", "linear")]
        parts = ("odd", "even", "nonlinear", "noise", "time_variation")
        known = [(name, force[name]) for name in parts if force[name] is not None]
        return whole + [{"part": name, **{key: one[key] for key in ("rms", "low", "high")}} for name, one in known]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_analysis(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return analysis_text(self.result)

    def _repr_html_(self) -> str:
        cells = [[_cell(value) for value in row.values()] for row in self.rows()]
        return table(("part of the force", "N rms", "from", "to"), cells) + "".join(
            paragraph(note) for note in self.result.notes
        )


def _cell(value: str | float | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.4g}"


def analyse(runs: Run | Iterable[Run]) -> Analysed:
    """Linear part, odd and even distortion, noise and change over time of runs of one multisine design.

    Raises
    ------
    DataError, AnalysisError
        Where the runs do not go together, do not repeat, or tell nothing.
    """
    measured = listed(runs)
    check_runs(measured, once=True)
    with working("analysing"):
        return Analysed(analyse_runs(measured))
