"""The page of a vehicle study: a table of figures and the curves of every damper over each other."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.studies.page_parts import COLOURS, STYLE, THEME, styled
from identification.studies.vehicle.answer import Curve, Study, cell, name_of

_POINTS = 3000  # of a curve: a screen shows no more


def write_study(path: Path, study: Study, note: str = "") -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(study_html(study, note), encoding="utf-8")


def study_html(study: Study, note: str = "") -> str:
    """The page as text; `note` is a sentence above the table."""
    colours = {one.label: COLOURS[k % len(COLOURS)] for k, one in enumerate(study.answers)}
    titles = list(dict.fromkeys(curve.title for one in study.answers for curve in one.curves))
    plots = [
        _figure(study, title, colours).to_html(full_html=False, include_plotlyjs=k == 0, div_id=f"figure-{k}")
        for k, title in enumerate(titles)
    ]
    notes = [f"<li>{escape(one.label)}: {escape(text)}</li>" for one in study.answers for text in one.notes]
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(study.title)}</title><style>{STYLE}</style>"
        f"<h1>{escape(study.title)}</h1><p>{escape(study.setting)}</p>"
        + (f"<p><b>{escape(note)}</b></p>" if note else "")
        + _table(study, colours)
        + (f"<ul>{''.join(notes)}</ul>" if notes else "")
        + "".join(plots)
        + THEME
        + "</html>"
    )


def _table(study: Study, colours: dict[str, str]) -> str:
    names = list(dict.fromkeys(figure.name for one in study.answers for figure in one.figures))
    head = "".join(
        f"<th><i class=dot style='background:{colours[one.label]}'></i>{escape(one.label)}</th>"
        for one in study.answers
    )
    rows = "".join(
        f"<tr><td>{escape(name_of(study, name))}</td>"
        + "".join(f"<td>{escape(cell(study, one, name))}</td>" for one in study.answers)
        + "</tr>"
        for name in names
    )
    several = "In brackets: the change against the first column." if len(study.answers) > 1 else ""
    return f"<div class=scroll><table><tr><th></th>{head}</tr>{rows}</table></div><p class=note>{several}</p>"


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
