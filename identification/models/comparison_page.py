"""The page of a comparison: a table of the models, one of models × runs, and their forces over the measured ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.models.compare import Cell, Comparison, Course, Row

Floats = NDArray[np.float64]

MEASURED = "#1b1b1b"
_COLOURS = ("#00798c", "#d1495b", "#e0a800", "#7b2d8b", "#6a994e", "#e07a5f", "#5b7fde", "#8d6e63")
_LAYOUT = {"template": "plotly_white", "font": {"family": "system-ui, sans-serif", "size": 13}}
_POINTS = 1000  # of a curve: a screen shows no more
_LONGEST = 160  # characters of a failure in a field; all of it is its title
_SHOWN = 4000  # samples of a run without periods: about its fastest moment
_STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1180px;margin:2em auto;padding:0 1em;color:#1b1b1b}
h1{font-size:1.5em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:1.8em}.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
td,th{padding:.3em .6em;border-bottom:1px solid #ddd;text-align:right;vertical-align:top}th{background:#f6f6f6}
td:first-child,th:first-child{text-align:left}td.best{font-weight:600;color:#00606f}
td small{color:#555;display:block;font-weight:400;white-space:nowrap}
td.word,th.word{text-align:left}
td.failed{color:#a02c3c;text-align:left;font-size:.85em;max-width:20em}p.note{color:#555}
i.dot{display:inline-block;width:.75em;height:.75em;border-radius:50%;margin-right:.45em}"""
_NOTES = """Every model is simulated from the run's displacement, current and temperature alone; the measured force is
only compared. rms: of measured minus simulated force over all samples. rrmsse: that over the rms of the measured force
about its mean. Fit: 100 − rrmsse. EEARTH: phase, magnitude and slope of the time history, 1 is perfect. Cost: median
time of repeated simulation of all samples, over their number, on the machine that made this page; that of an FMU
includes its start and the transfer to its process. Parameters: those that a fit may move, of all. Noise: the difference
between the periods of the force, which no model can explain. Pale: the band within which a model expects 90 % of the
measured samples; that share as it came out stands in the table of the runs."""


def write_comparison(path: Path, comparison: Comparison) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(comparison_html(comparison), encoding="utf-8")


def comparison_html(comparison: Comparison) -> str:
    """The page as text."""
    rows = comparison.best_first()
    colours = _colours(rows)
    count = f"{_counted(len(rows), 'model')} on {_counted(len(comparison.courses), 'run')}"
    drawn = courses(rows, comparison.courses, colours).to_html(full_html=False, div_id="figure-0")
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Comparison of {count}</title>'
        f"<style>{_STYLE}</style></head><body><h1>Comparison of {count}</h1>{_in_short(rows)}"
        f"<h2>Models, the smallest error first</h2><div class=scroll>{_models(rows, colours)}</div>"
        f"<h2>Error on every run</h2><div class=scroll>{_runs(rows, comparison.courses, colours)}</div>"
        f"<h2>Force of every model</h2>{drawn}<h2>Error and cost</h2>{_cost(rows, colours)}"
        f"<p class=note>{_NOTES}</p></body></html>\n"
    )


def _cost(rows: Sequence[Row], colours: dict[str, str]) -> str:
    """The chart of error and cost; a sentence where there is nothing to draw."""
    if all(row.rms is None for row in rows):
        return "<p>No model has an error over all runs.</p>"
    drawn: str = cost_and_error(rows, colours).to_html(full_html=False, include_plotlyjs=False, div_id="figure-1")
    return drawn


def forces(comparison: Comparison) -> go.Figure:
    """The force of every model over the measured one."""
    rows = comparison.best_first()
    return courses(rows, comparison.courses, _colours(rows))


def _colours(rows: Sequence[Row]) -> dict[str, str]:
    return {row.label: _COLOURS[k % len(_COLOURS)] for k, row in enumerate(rows)}


def _in_short(rows: Sequence[Row]) -> str:
    """The answer in one sentence."""
    best = rows[0]
    if best.rms is None or best.fit is None:
        return "<p>No model could be simulated on every run.</p>"
    return f"<p><b>{escape(best.label)}</b> has the smallest error: {best.rms:.3g} N rms, fit {best.fit:.1f} %.</p>"


def _models(rows: Sequence[Row], colours: dict[str, str]) -> str:
    head = ("model", "kind", "rms, N", "rrmsse, %", "fit, %", "EEARTH", "cost, ns per sample", "parameters",
            "training range")  # fmt: skip
    best = {
        "rms": _least(r.rms for r in rows),
        "cost": _least(r.cost_ns for r in rows),
        "eearth": _least(None if r.eearth is None else -r.eearth for r in rows),
    }
    body = ""
    for r in rows:
        nearest = r.rms is not None and r.rms == best["rms"]
        cells = [
            _cell(_named(r.label, colours)),
            f"<td class=word>{escape(r.kind)}</td>",
            *(_cell(text, nearest) for text in (_rms(r), _figure(r.rrmsse, ".3g"), _figure(r.fit, ".2f"))),
            _cell(_figure(r.eearth, ".3f"), r.eearth is not None and -r.eearth == best["eearth"]),
            _cell(_figure(r.cost_ns, ",.0f"), r.cost_ns is not None and r.cost_ns == best["cost"]),
            _cell("not stated" if r.parameters is None else f"{r.free} of {r.parameters}"),
            _cell(_range(r)),
        ]
        body += f"<tr>{''.join(cells)}</tr>"
    return f"<table><thead><tr>{_heads(head)}</tr></thead><tbody>{body}</tbody></table>"


def _rms(row: Row) -> str:
    """The error over all runs, or on how many runs there is none."""
    failed = sum(cell.score is None for cell in row.cells)
    return f"fails on {failed} of {_counted(len(row.cells), 'run')}" if failed else _figure(row.rms, ".4g")


def _heads(heads: Sequence[str]) -> str:
    return "".join(f"<th{' class=word' if h == 'kind' else ''}>{h}</th>" for h in heads)


def _range(row: Row) -> str:
    if not row.ranged:
        return "not stated"
    if all(cell.score is None for cell in row.cells):
        return "–"
    count = sum(bool(cell.left) for cell in row.cells)
    return f"left on {count} of {_counted(len(row.cells), 'run')}" if count else "kept on every run"


def _runs(rows: Sequence[Row], courses: Sequence[Course], colours: dict[str, str]) -> str:
    head = "".join(f"<th>{_named(row.label, colours)}</th>" for row in rows)
    body = ""
    for k, course in enumerate(courses):
        cells = [row.cells[k] for row in rows]
        least = _least(None if c.score is None else c.score.rms for c in cells)
        noise = "–" if course.noise is None else f"{course.noise:.3g}"
        body += f"<tr><td>{escape(course.name)}<small>{_what(course)}</small></td>"
        body += f"<td>{float(np.std(course.run.channels['force'])):.4g}</td><td>{noise}</td>"
        body += "".join(_run_cell(cell, least) for cell in cells) + "</tr>"
    return (
        f"<table><thead><tr><th>run</th><th>rms force, N</th><th>noise, N</th>{head}</tr></thead>"
        f"<tbody>{body}</tbody></table><p class=note>In each field: rms of the error, N; below it rrmsse and fit, "
        "and EEARTH. A deeper colour is a larger error relative to the force; bold: the smallest error on that run.</p>"
    )


def _what(course: Course) -> str:
    motion = course.motion
    kind, seconds = course.run.excitation_kind, course.run.samples / course.run.sample_rate_hz
    return f"{escape(kind)}, {seconds:.3g} s, up to {float(np.max(np.abs(motion.v))):.3g} m/s"


def _run_cell(cell: Cell, least: float | None) -> str:
    if cell.score is None:
        return f'<td class=failed title="{escape(cell.failure)}">fails: {escape(_cut(cell.failure))}</td>'
    s = cell.score
    outside = "".join(
        f"<small>{escape(name)}: {_percent(share)} outside training</small>"
        for name, share in (cell.left or {}).items()
    )
    if cell.covered is not None:
        outside += f"<small>90 % band holds {_percent(cell.covered)}</small>"
    # White below 1 %, full colour at 100 %: an error is judged by its order.
    depth = min(max(math.log10(max(s.rrmsse, 1e-9)) / 2.0, 0.0), 1.0)
    style = f'style="background:rgba(209,73,91,{0.55 * depth:.2f})"'
    mark = "class=best " if least is not None and s.rms == least else ""
    figures = f"<small>{s.rrmsse:.3g} %, fit {s.fit:.1f} %</small><small>EEARTH {s.eearth:.3f}</small>"
    return f"<td {mark}{style}>{s.rms:.4g}{figures}{outside}</td>"


def courses(rows: Sequence[Row], runs: Sequence[Course], colours: dict[str, str]) -> go.Figure:
    """Force and error over time and force over velocity, measured and of every model; a menu chooses the run."""
    figure = make_subplots(
        rows=2, cols=2, specs=[[{}, {"rowspan": 2}], [{}, None]], column_widths=[0.6, 0.4], row_heights=[0.65, 0.35],
        shared_xaxes=True, vertical_spacing=0.08, horizontal_spacing=0.09,
    )  # fmt: skip
    owners: list[int] = []
    for k, course in enumerate(runs):
        shown = _shown(course)
        time, v = shown / course.run.sample_rate_hz, course.motion.v[np.minimum(shown, course.motion.v.size - 1)]
        measured = course.run.channels["force"][shown]
        curves = [("measured", measured, MEASURED, 0)]
        curves += [
            (escape(row.label), force[shown], colours[row.label], rank)
            for rank, row in reversed(list(enumerate(rows, start=1)))  # the best on top
            if (force := row.cells[k].force) is not None
        ]
        for row in reversed(rows):
            cell = row.cells[k]
            if cell.force is not None and cell.half is not None:
                edges = (cell.force[shown] - cell.half[shown], cell.force[shown] + cell.half[shown])
                for edge, fill in zip(edges, (None, "tonexty"), strict=True):
                    figure.add_scatter(
                        x=time, y=edge, mode="lines", line={"width": 0, "color": colours[row.label]}, fill=fill,
                        fillcolor=_pale(colours[row.label]), legendgroup=escape(row.label), showlegend=False,
                        hoverinfo="skip", visible=k == 0, row=1, col=1,
                    )  # fmt: skip
                    owners.append(k)
        for name, force, colour, rank in curves:
            line = {"color": colour, "width": 2.5 if name == "measured" else 1.5}
            panels = [(1, 1, time, force), (1, 2, v, force)]
            panels += [(2, 1, time, measured - force)] if name != "measured" else []
            for panel, (line_of, column, across, up) in enumerate(panels):
                figure.add_scatter(
                    x=across, y=up, mode="lines", name=name, legendgroup=name, showlegend=panel == 0, line=line,
                    legendrank=rank, visible=k == 0, row=line_of, col=column,
                )  # fmt: skip
                owners.append(k)
    figure.update_xaxes(title="time, s", row=2, col=1)
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_yaxes(title="force, N", row=1, col=1)
    figure.update_yaxes(title="error, N", row=2, col=1)
    figure.update_yaxes(title="force, N", row=1, col=2)
    buttons = [
        {"label": course.name, "method": "update", "args": [{"visible": [owner == k for owner in owners]}]}
        for k, course in enumerate(runs)
    ]
    menu = [{"buttons": buttons, "x": 0.0, "xanchor": "left", "y": 1.16, "yanchor": "top"}] if len(runs) > 1 else []
    legend = {"orientation": "h", "y": -0.14}
    return figure.update_layout(height=620, updatemenus=menu, legend=legend, margin={"t": 80, "r": 20}, **_LAYOUT)


def _pale(colour: str) -> str:
    """A colour of six digits through which what lies behind it is seen."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.15)"


def _shown(course: Course) -> NDArray[np.int64]:
    """Samples that a picture shows: the last period, or the stretch about the fastest moment."""
    period, size = course.motion.period, course.motion.x.size
    if period:
        first, last = size - period, size
    else:
        middle = int(np.argmax(np.abs(course.motion.v)))
        first = max(min(middle - _SHOWN // 2, size - _SHOWN), 0)
        last = min(first + _SHOWN, size)
    return np.arange(first, last, max(1, -(-(last - first) // _POINTS)))


def cost_and_error(rows: Sequence[Row], colours: dict[str, str]) -> go.Figure:
    """Error over all runs against the cost of a sample, a point for every model that ran on all."""
    figure = go.Figure()
    for row in rows:
        if row.rms is not None and row.cost_ns is not None:
            name, marker = escape(row.label), {"size": 12, "color": colours[row.label]}
            figure.add_scatter(
                x=[row.cost_ns], y=[row.rms], mode="markers", cliponaxis=False, name=name, showlegend=True,
                marker=marker,
            )  # fmt: skip
    figure.update_xaxes(title="cost, ns per sample", type="log", dtick="D2")
    figure.update_yaxes(title="rms of the error over all runs, N", rangemode="tozero")
    legend = {"orientation": "h", "y": -0.25}  # names beside the points cover each other where models are alike
    return figure.update_layout(height=430, legend=legend, margin={"t": 30, "r": 20}, **_LAYOUT)


def _percent(share: float) -> str:
    """A share in percent, such that a little is not nothing, and most is not all."""
    text = f"{100.0 * share:.0f}"
    if text == "0" and share > 0.0:
        return "under 1 %"
    return "over 99 %" if text == "100" and share < 1.0 else f"{text} %"


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _named(label: str, colours: dict[str, str]) -> str:
    return f'<i class=dot style="background:{colours[label]}"></i>{escape(label)}'


def _cell(text: str, best: bool = False) -> str:
    return f"<td{' class=best' if best else ''}>{text}</td>"


def _figure(value: float | None, form: str) -> str:
    return "–" if value is None else f"{value:{form}}"


def _least(values: Iterable[float | None]) -> float | None:
    return min((v for v in values if v is not None), default=None)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' * (count != 1)}"
