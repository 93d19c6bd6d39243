"""The characteristic sheet as a part of the page of a report."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from identification.report.charts import PANELS
from identification.report.sheet_data import SheetData

_COLOURS = ("#00798c", "#d1495b", "#b07d00", "#4a86c5", "#5a9a4e", "#a565c4", "#c96f2f", "#808890")
_NOTE = (
    "From the steady sines among the runs. Extension and tension are positive. Gas force: the force at rest, at mid "
    "stroke, that pushes the rod out, with an offset of the load cell; ± is one standard deviation. What saturates "
    "below the slowest speed counts as friction. The whole sheet: damper-rig characterise."
)


def sheet_text(sheet: SheetData) -> str:
    """What was found at rest and the figures of each test, as two tables."""
    rest = _table(
        ("current, A", "gas force, N", "its stiffness, N/m", "friction, N", "slowest test, m/s"), _rest(sheet)
    )
    tests = _table(_TEST, _tests(sheet))
    return f"<p class=note>{_NOTE}</p>{rest}<p></p>{tests}"


_TEST = (
    *("run", "amplitude, mm", "frequency, Hz", "current, A", "rebound: speed, m/s", "force, N"),
    *("compression: speed, m/s", "force, N", "hysteresis width, N", "energy per cycle, J", "stiffness, kN/m"),
)


def _rest(sheet: SheetData) -> Iterator[Sequence[str]]:
    r = sheet.at_rest
    for k in range(r.current.size):
        gas, stiffness = _with(-r.force[k], r.force_std[k]), _with(r.stiffness[k], r.stiffness_std[k])
        friction = _with(r.friction[k], r.friction_std[k])
        yield _current(r.current[k]), gas, stiffness, friction, f"{r.slowest[k]:.2g}"


def _tests(sheet: SheetData) -> Iterator[Sequence[str]]:
    t = sheet.tests
    for k, run in enumerate(t.runs):
        yield (
            run, f"{1e3 * t.amplitude[k]:g}", f"{t.frequency[k]:g}", _current(t.current[k]),
            f"{t.speed_rebound[k]:.3g}", f"{t.force_rebound[k]:.1f}", f"{t.speed_compression[k]:.3g}",
            f"{t.force_compression[k]:.1f}", f"{t.width[k]:.4g}", f"{t.energy[k]:.4g}", f"{t.stiffness[k] / 1e3:.4g}",
        )  # fmt: skip


def _with(value: float, std: float) -> str:
    """The value as far as its standard deviation lets it be told."""
    if not (math.isfinite(std) and std > 0.0):
        return f"{value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(std)))
    return f"{value:.{digits}f} ± {std:.{digits}f}"


def _current(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:g}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    header = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><tr>{header}</tr>{body}</table></div>'


def sheet_chart(sheet: SheetData) -> go.Figure:
    """PVP with the curve of each side, and the loops of the fastest test at each current."""
    titles = ("at peak speed (PVP): rebound ▲, compression ▼", "force over velocity (CVP), fastest test")
    figure = make_subplots(rows=1, cols=2, subplot_titles=titles)
    colours = {_current(current): _COLOURS[k % len(_COLOURS)] for k, current in enumerate(sheet.at_rest.current)}
    for label, colour in colours.items():
        _points(figure, sheet, label, colour)
    for curve in sheet.curves:
        line = {"color": list(colours.values())[curve.at % len(colours)], "width": 1.5}
        for force in (curve.rebound, curve.compression):
            figure.add_scatter(x=curve.speed, y=force, mode="lines", showlegend=False, hoverinfo="skip", row=1, col=1,
                               line=line)  # fmt: skip
    for loop, colour in zip(sheet.loops, colours.values(), strict=False):
        figure.add_scatter(x=loop.velocity, y=loop.force, mode="lines", name=loop.label, row=1, col=2,
                           line={"color": colour, "width": 1.8})  # fmt: skip
    figure.update_xaxes(title="peak speed, m/s", rangemode="tozero", row=1, col=1)
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_yaxes(title="force, N", col=1)
    return figure.update_layout(title="The damper as measured", height=470, **PANELS)


def _points(figure: go.Figure, sheet: SheetData, label: str, colour: str) -> None:
    t = sheet.tests
    own = np.array([_current(current) == label for current in t.current])
    name = "tests" if label == "–" else f"tests at {label} A"
    sides = (
        (t.speed_rebound, t.force_rebound, "triangle-up"),
        (t.speed_compression, t.force_compression, "triangle-down"),
    )
    for k, (speed, force, symbol) in enumerate(sides):
        marker = {"size": 9, "color": colour, "symbol": symbol}
        figure.add_scatter(x=np.abs(speed[own]), y=force[own], mode="markers", name=name, legendgroup=name,
                           showlegend=k == 0, marker=marker, row=1, col=1)  # fmt: skip
