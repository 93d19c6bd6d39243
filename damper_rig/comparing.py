"""Models of any kind compared on measured runs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damper_rig.html import table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, at_rate, model_of
from identification.measured import check_runs
from identification.models import KINDS, Comparison, comparison_data, comparison_text
from identification.models import compare as compared
from identification.models.comparison_page import write_comparison
from identification.multiaxis import MAIN_FORCE
from rigctl.runfile import Run

__all__ = ["Compared", "compare"]


@dataclass(frozen=True, slots=True)
class Compared:
    """Error, cost and parameters of each model; ``result`` holds them run by run."""

    result: Comparison

    @property
    def best(self) -> str:
        """The label of the model with the smallest error."""
        return self.result.best_first()[0].label

    def data(self) -> dict[str, Any]:
        """What `damper-rig compare --json` prints, without the file."""
        return comparison_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The models, a dictionary each, in the order in which they were given."""
        return [{key: value for key, value in row.items() if key != "runs"} for row in self.data()["models"]]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; raises OutputError."""
        write_comparison(Path(path), self.result)
        return Path(path)

    def __repr__(self) -> str:
        return comparison_text(self.result)

    def _repr_html_(self) -> str:
        rows = [
            (
                row.label,
                row.kind,
                *("fails" if one is None else f"{one:.4g}" for one in (row.rms, row.fit, row.eearth, row.cost_ns)),
                "not stated" if row.free is None else str(row.free),
            )
            for row in self.result.best_first()
        ]
        heads = ("model", "kind", "rms, N", "fit, %", "EEARTH", "cost, ns per sample", "free parameters")
        return table(heads, rows)


def compare(
    models: Mapping[str, AnyModel] | Iterable[AnyModel], runs: Run | Iterable[Run], *, rate_hz: float | None = None
) -> Compared:
    """Simulate every model along every run, from the run's inputs alone; labels are the keys of a mapping.

    ``rate_hz``: all runs are resampled to it first.

    Raises
    ------
    DataError
        Where there is no model or no run, or where a run lacks what is needed.
    """
    named = dict(models) if isinstance(models, Mapping) else {}
    given = list(named.values()) if named else list(models)
    loaded, measured = [model_of(one, (*KINDS, MAIN_FORCE)) for one in given], at_rate(listed(runs), rate_hz)
    check_runs(measured)
    with working("comparing") as tell:
        return Compared(compared(loaded, measured, labels=list(named) or _labels(given), on_progress=tell))


def _labels(given: Iterable[AnyModel]) -> list[str]:
    """The names of the files, else those of the models; numbered where two are the same."""
    names = [Path(one).name if isinstance(one, str | os.PathLike) else one.name for one in given]
    return [name if names.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(names, start=1)]
