"""The page of a vehicle study: a table of figures and the curves of every damper over each other."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.page_style import COLOURS, document, plots, table
from identification.studies.page_parts import styled
from identification.studies.vehicle.answer import Curve, Study, cell, name_of

_POINTS = 3000  # of a curve: a screen shows no more


def write_study(path: Path, study: Study, note: str = "") -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(study_html(study, note), encoding="utf-8")


def study_html(study: Study, note: str = "") -> str:
    """The page as text; `note` is a sentence above the table."""
    return document(study.title, _parts(study, note))


def _parts(study: Study, note: str) -> Iterator[str]:
    colours = {one.label: COLOURS[k % len(COLOURS)] for k, one in enumerate(study.answers)}
    yield f"<h1>{escape(study.title)}</h1><p>{escape(study.setting)}</p>"
    if note:
        yield f"<p><b>{escape(note)}</b></p>"
    names = list(dict.fromkeys(figure.name for one in study.answers for figure in one.figures))
    head = "".join(f"<th>{_dot(colours[one.label])}{escape(one.label)}</th>" for one in study.answers)
    rows = [
        [escape(name_of(study, name)), *(escape(cell(study, one, name)) for one in study.answers)] for name in names
    ]
    yield table(f"<tr><th></th>{head}</tr>", rows)
    if len(study.answers) > 1:
        yield "<p class=note>In brackets: the change against the first column.</p>"
    notes = [f"<li>{escape(one.label)}: {escape(text)}</li>" for one in study.answers for text in one.notes]
    yield f"<ul>{''.join(notes)}</ul>" if notes else ""
    titles = dict.fromkeys(curve.title for one in study.answers for curve in one.curves)
    yield from plots(_figure(study, title, colours) for title in titles)


def _dot(colour: str) -> str:
    return (
        f"<i style='display:inline-block;width:.75em;height:.75em;border-radius:50%;margin-right:.45em;"
        f"background:{colour}'></i>"
    )


def _figure(study: Study, title: str, colours: dict[str, str]) -> go.Figure:
    figure = go.Figure()
    for one in study.answers:
        for curve in (curve for curve in one.curves if curve.title == title):
            figure.add_trace(_trace(curve, one.label, colours[one.label]))
            figure.update_xaxes(title=curve.x_name)
            figure.update_yaxes(title=curve.y_name)
    return styled(figure, title)


def _trace(curve: Curve, label: str, colour: str) -> go.Scatter:
    every = np.arange(0, curve.x.size, max(1, -(-curve.x.size // _POINTS)))
    return go.Scatter(
        x=curve.x[every],
        y=curve.y[every],
        name=label,
        mode="markers" if curve.style == "markers" else "lines",
        line={"color": colour, "width": 1.5, "shape": "hv" if curve.style == "steps" else "linear"},
        marker={"color": colour, "size": 4},
    )
