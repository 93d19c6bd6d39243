"""The characteristic sheet of a damper from its sine tests."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from damper_rig.html import table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.measured import check_runs
from identification.sheet import html_of, sheet_of, sheet_to_json
from rigctl.runfile import Run

__all__ = ["Sheet", "characterise"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """The figures of `damper-rig characterise`, SI, and its page: the tests, and the damper at each current."""

    tests: tuple[dict[str, Any], ...]
    currents: tuple[dict[str, Any], ...]
    page: str = field(repr=False)

    def rows(self) -> list[dict[str, Any]]:
        """The tests, a dictionary each."""
        return list(self.tests)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        with written_whole(Path(path), OutputError) as temporary:
            temporary.write_text(self.page, encoding="utf-8")
        return Path(path)

    def __repr__(self) -> str:
        return "\n".join([f"{len(self.tests)} tests", *("  ".join(row) for row in self._cells())])

    def _repr_html_(self) -> str:
        return table([name.replace("_", " ") for name in self.tests[0]], self._cells())

    def _cells(self) -> list[tuple[str, ...]]:
        return [
            tuple(f"{one:.4g}" if isinstance(one, float) else "" if one is None else str(one) for one in test.values())
            for test in self.tests
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
        sheet = sheet_of(measured, beside)
        figures = sheet_to_json(sheet)
        return Sheet(tests=tuple(figures["tests"]), currents=tuple(figures["currents"]), page=html_of(sheet))
