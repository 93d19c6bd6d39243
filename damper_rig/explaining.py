"""What a simulation is missing, named."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Final

from damper_rig.html import paragraph, table
from damper_rig.running import working
from damper_rig.runs import listed
from damper_rig.simulating import AnyModel, model_of
from identification.discrepancy import Explanation, explain_any, questions, report_data, write_report
from identification.measured import check_runs
from identification.physical.model import Model
from identification.report import report_lines
from rigctl.runfile import Run

__all__ = ["Explained", "explain"]

_STEPS: Final = (
    ("as given", "as_given"),
    ("parameters refitted", "base_refitted"),
    ("with what is named", "final"),
    ("noise floor", "noise_floor"),
)


@dataclass(frozen=True, slots=True)
class Explained:
    """Verdict, names with confidence, and the gap at each step; ``result`` holds everything that was found."""

    result: Explanation
    runs: tuple[Run, ...] = ()  # those that were explained, for the sheet in the report

    @property
    def verdict(self) -> str:
        return str(self.result.verdict)

    @property
    def names(self) -> tuple[str, ...]:
        """The elements that are missing, in the order of the report."""
        return tuple(effect.element for effect in self.result.effects)

    @property
    def model(self) -> Model:
        """The model with what it was missing."""
        return self.result.model

    @property
    def questions(self) -> list[str]:
        """Questions about the input that the result raises."""
        return questions(self.result)

    def data(self) -> dict[str, Any]:
        """The content of report.json."""
        return report_data(self.result)

    def rows(self) -> list[dict[str, Any]]:
        """The named effects, a dictionary each."""
        return list(self.data()["effects"])

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write report.json, evidence.h5, model.json and report.html; returns the path of the page."""
        return write_report(self.result, Path(folder), runs=self.runs)

    def __repr__(self) -> str:
        return "\n".join([*report_lines(self.data()), *self.questions])

    def _repr_html_(self) -> str:
        data = self.data()
        verdict, *_ = report_lines(data)
        parts = [paragraph(verdict, strong=True)]
        if self.names:
            parts.append(table(("missing", "path", "confidence", "parameters", "or else"), _effects(data)))
        parts.append(table(("gap", "held-out runs, N rms", "training runs, N rms", ""), _ladder(data), raw=(3,)))
        parts += [paragraph(text) for text in (data["remainder"]["text"], data["next_test"]["text"]) if text]
        return "".join([*parts, *map(paragraph, self.questions)])


def _effects(data: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for effect in data["effects"]:
        values = ", ".join(f"{n} = {p['value']:.4g} {p['unit']}".rstrip() for n, p in effect["parameters"].items())
        others = ", ".join(f"{one['element']} ({one['confidence']:.2f})" for one in effect["alternatives"])
        yield effect["element"], effect["path"], f"{effect['confidence']:.2f}", values, others


def _ladder(data: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    held, train = data["gap"]["held_out"], data["gap"]["train"]
    most = max(held[key] for _, key in _STEPS) or 1.0
    for step, key in _STEPS:
        colour = "#e0a800" if key == "noise_floor" else "#00798c"
        bar = f'<div style="width:{12.0 * held[key] / most:.2f}em;height:.8em;background:{escape(colour)}"></div>'
        yield step, f"{held[key]:.4g}", f"{train[key]:.4g}", bar


def explain(model: AnyModel | None, runs: Run | Iterable[Run], *, held_out: Run | Iterable[Run] = ()) -> Explained:
    """Find where simulation and measurement differ, name what is missing, add it, and show the gap that is left.

    ``model`` None: the runs contain the simulated force of any program in a channel `force_simulated`. ``held_out``:
    runs that no fit may see; without them some of ``runs`` are kept back.

    Raises
    ------
    DataError
        Where the runs cannot be used together, or not for this model.
    SimulationError
        Where the model as given cannot run on them.
    """
    given, measured, kept = None if model is None else model_of(model), listed(runs), listed(held_out)
    check_runs([*measured, *kept], once=True)
    with working("explaining") as tell:
        found = explain_any(given, measured, kept or None, on_progress=tell)
    return Explained(found, (*measured, *kept))
