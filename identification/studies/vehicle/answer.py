"""What a vehicle study answers for one damper: figures with units, curves, and notes; and those of several compared."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number with its name and unit, SI; NaN where there is none."""

    name: str
    unit: str
    value: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """y over x, (K,) each; curves of one title are drawn together."""

    title: str
    x_name: str
    y_name: str
    x: Floats
    y: Floats
    style: str = "lines"  # or "markers", "steps"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What one damper does in the vehicle."""

    label: str
    figures: tuple[Figure, ...]
    curves: tuple[Curve, ...] = ()
    notes: tuple[str, ...] = ()

    def figure(self, name: str) -> Figure:
        """The figure of a name; raises DataError where there is none."""
        for one in self.figures:
            if one.name == name:
                return one
        raise DataError(f"no figure is called {name!r}: there are {', '.join(one.name for one in self.figures)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """The answers of several dampers in one vehicle, the first of which the others are compared with."""

    title: str
    setting: str  # the vehicle and what moves it, in one sentence
    answers: tuple[Answer, ...]
    facts: dict[str, Any] = field(default_factory=dict)  # the settings, as JSON. Any: what JSON can say

    def change(self, label: str, name: str) -> float:
        """By how many percent a figure of an answer differs from that of the first."""
        first, other = self.answers[0].figure(name).value, self._of(label).figure(name).value
        return 100.0 * (other / first - 1.0) if first else math.nan

    def _of(self, label: str) -> Answer:
        for one in self.answers:
            if one.label == label:
                return one
        raise DataError(f"no answer is called {label!r}: there are {', '.join(one.label for one in self.answers)}")


def study_data(study: Study) -> dict[str, Any]:
    """The figures and settings as JSON data; a figure that there is none of is null. Any: what JSON can say."""
    return {
        "study": study.title,
        "setting": study.setting,
        "settings": study.facts,
        "answers": [
            {
                "label": one.label,
                "figures": [
                    {"name": f.name, "unit": f.unit, "value": f.value if math.isfinite(f.value) else None}
                    for f in one.figures
                ],
                "notes": list(one.notes),
            }
            for one in study.answers
        ],
    }


def study_text(study: Study) -> str:
    """The figures as a table of text, a row each, with the change against the first damper."""
    names = list(dict.fromkeys(figure.name for one in study.answers for figure in one.figures))
    rows = [["", *(one.label for one in study.answers)]]
    rows += [[name_of(study, name), *(cell(study, one, name) for one in study.answers)] for name in names]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    notes = [f"{one.label}: {note}" for one in study.answers for note in one.notes]
    return "\n".join([study.setting, *lines, *notes])


def name_of(study: Study, name: str) -> str:
    """The name of a figure with its unit."""
    unit = next(f.unit for one in study.answers for f in one.figures if f.name == name)
    return f"{name}, {unit}" if unit else name


def cell(study: Study, answer: Answer, name: str) -> str:
    """A figure and its change against the first damper."""
    if not any(f.name == name for f in answer.figures):
        return "–"
    value = answer.figure(name).value
    if not math.isfinite(value):
        return "–"
    first = study.answers[0]
    known = answer is not first and any(f.name == name for f in first.figures)
    change = study.change(answer.label, name) if known else math.nan
    return f"{value:.4g} ({change:+.1f} %)" if math.isfinite(change) else f"{value:.4g}"


def labels_of(names: Sequence[str]) -> list[str]:
    """The names, numbered where two are the same."""
    return [name if list(names).count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]
