"""The characteristic sheet of a damper from its sine tests."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from identification.measured import check_runs
from identification.sheet import Sheet as SheetResult
from identification.sheet import sheet_of, sheet_to_json, write_sheet
from rigctl.runfile import Run

__all__ = ["Sheet", "characterise"]


@dataclass(frozen=True, slots=True)
class Sheet:
    """The figures of `damper-rig characterise`, SI, and its page: the tests, and the damper at each current."""

    result: SheetResult

    def data(self) -> dict[str, Any]:
        """What `damper-rig characterise --json` prints, without the file."""
        return sheet_to_json(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The tests, a dictionary each."""
        return list(self.data()["tests"])

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_sheet(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return "\n".join([f"{len(self.rows())} tests", *("  ".join(row) for row in self._cells())])

    def _repr_html_(self) -> str:
        return table([name.replace("_", " ") for name in self.rows()[0]], self._cells())

    def _cells(self) -> list[tuple[str, ...]]:
        return [
            tuple(f"{one:.4g}" if isinstance(one, float) else "" if one is None else str(one) for one in test.values())
            for test in self.rows()
        ]


def characterise(runs: Run | Iterable[Run], model: AnyModel | None = None) -> Sheet:
    """PVP and CVP, forces at rest and loops of sine tests, beside those of a model.

    Raises
    ------
    DataError
        Where no run is a steady sine, or where one lacks what the model needs.
    """
    beside, measured = None if model is None else model_of(model), listed(runs)
    check_runs(measured)
    with working("characterising"):
        return Sheet(sheet_of(measured, beside))
