"""The page of an exploration: limits, extremes, bands over frequency, corner plot, correlations."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.page_style import COLOURS, LAYOUT, document, plots, table
from identification.studies.exploration.described import in_short
from identification.studies.exploration.result import CRITERIA, Explored, figure_names

Floats = NDArray[np.float64]

_GREY = "#8b98a3"
_GRID = {"gridcolor": "rgba(128,140,150,0.25)", "zeroline": False, "ticks": "outside"}
_SHOWN = 400  # feasible samples, and rejected ones, in the corner plot: more hide each other
_MOST_CORNERS = 6  # parameters: of more, those with the greatest effect
_ON_CRITERIA = (
    "Each sample is simulated along the measured displacement of every test, until its cycle repeats. Dynamic "
    "stiffness: |F/X| at the first harmonic. Loss angle: the phase of F/X. Loop shape: 2|F<sub>1</sub>| over the range "
    "of the force, 1 for an ellipse, 1.27 for a rectangle, below 1 for a peaked loop: it is what the first two leave "
    "open, because under a sine they fix the area of the loop. Reached: the greatest deviation from a measured value "
    "of any feasible sample in any test. Rejected by it alone: samples that keep the other two limits on every test."
)
_ON_EFFECTS = (
    "Rank correlation (Spearman, −1 … 1) over all samples of a parameter with the greatest deviation from the tests. "
    "Near 0: within this range the tests say little about the parameter through this figure alone."
)
# Clear in the middle, so that its numbers can be read in the ink of light and of dark pages.
_SCALE = ((0.0, "rgba(209,73,91,.85)"), (0.5, "rgba(128,136,144,.08)"), (1.0, "rgba(26,143,143,.85)"))


def write_explored(path: Path, found: Explored) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(document("Exploration", _parts(found)), encoding="utf-8")


def _parts(found: Explored) -> Iterator[str]:
    yield f"<h1>Feasible parameters: {html.escape(found.model)}</h1><p><b>{html.escape(in_short(found))}</b></p>"
    yield "<h2>Limits</h2>" + table(_heads("limit", "allowed", "reached", "rejected by it alone", "samples within it"),
                                    _limits(found))  # fmt: skip
    yield f"<p class=note>{_ON_CRITERIA}</p>"
    heads = ("parameter", "start", "range explored", "feasible", "feasible, times the start", *CRITERIA)
    yield "<h2>Parameters</h2>" + table(_heads(*heads), _parameters(found))
    yield f"<p class=note>Last three columns: {_ON_EFFECTS}</p>"
    if found.left_out:
        yield f"<p class=note>Left out, no steady sine: {html.escape(', '.join(found.left_out))}.</p>"
    yield f"<p class=note>{_how(found)}</p>"
    yield from plots(_figures(found))


def _how(found: Explored) -> str:
    asked = found.asked
    return (
        f"{asked.samples} {asked.sampling} samples, seed {asked.seed}, each parameter within {asked.low:g} … "
        f"{asked.high:g} times its start; {len(found.tests)} tests, {asked.points} points a cycle."
    )


def _heads(*names: str) -> str:
    return "<tr>" + "".join(f"<th>{name}</th>" for name in names) + "</tr>"


def _limits(found: Explored) -> Iterator[list[str]]:
    reached, alone = found.reached(), found.without_limit() - int(found.feasible.sum())
    for k, name in enumerate(CRITERIA):
        mark = " (binds)" if k == found.binding() else ""
        top = "–" if reached is None else f"{100.0 * reached[k]:.3g} %"
        within = int(found.within[:, k].sum())
        yield [name + mark, f"±{100.0 * found.asked.limits.row()[k]:g} %", top, str(alone[k]), str(within)]


def _parameters(found: Explored) -> Iterator[list[str]]:
    kept, effects = found.samples[found.feasible], found.effects()
    for k, name in enumerate(found.names):
        start = found.start[k]
        low, high = (kept[:, k].min(), kept[:, k].max()) if len(kept) else (np.nan, np.nan)
        cells = [f"{low:.4g} … {high:.4g}", f"{low / start:.3g} … {high / start:.3g}"] if len(kept) else ["–", "–"]
        span = f"{found.asked.low * start:.4g} … {found.asked.high * start:.4g}"
        yield [html.escape(name), f"{start:.4g}", span, *cells, *(f"{e:+.2f}" for e in effects[k])]


def _figures(found: Explored) -> list[go.Figure]:
    figures = [bands(found), corner(found)]
    correlations = found.correlations()
    if correlations is not None and len(found.names) > 1:
        figures.append(heat(correlations, found.names))
    return figures


def bands(found: Explored) -> go.Figure:
    """The three figures of every test over its frequency: measured, and the span of the feasible samples."""
    titles = [name[:1].upper() + name[1:] for name in figure_names()]
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.05, subplot_titles=titles)
    amplitudes = sorted({_rounded(t.amplitude_m) for t in found.tests})
    for criterion in range(3):
        scale = 180.0 / np.pi if criterion == 1 else 1.0
        for k, amplitude in enumerate(amplitudes):
            own = [i for i, t in enumerate(found.tests) if _rounded(t.amplitude_m) == amplitude]
            own.sort(key=lambda i: found.tests[i].frequency_hz)
            hertz = [found.tests[i].frequency_hz for i in own]
            colour, label = COLOURS[k % len(COLOURS)], f"{1e3 * amplitude:.3g} mm"
            feasible = scale * found.figures[found.feasible][:, own, criterion]
            if len(feasible):
                edges = [*feasible.max(axis=0), *feasible.min(axis=0)[::-1]]
                figure.add_scatter(
                    x=[*hertz, *hertz[::-1]], y=edges, fill="toself", mode="lines", line={"width": 0.5, "color": _GREY},
                    fillcolor="rgba(139,152,163,0.3)", legendgroup=label, showlegend=False, hoverinfo="skip",
                    row=criterion + 1, col=1,
                )  # fmt: skip
            figure.add_scatter(
                x=hertz, y=scale * found.measured[own, criterion], mode="lines+markers", name=label, legendgroup=label,
                line={"color": colour}, showlegend=criterion == 0, row=criterion + 1, col=1,
            )  # fmt: skip
    figure.update_xaxes(type="log", **_GRID)
    figure.update_xaxes(title="frequency, Hz", row=3, col=1)
    figure.update_yaxes(**_GRID)
    figure.update_yaxes(type="log", row=1, col=1)
    return figure.update_layout(height=900, title="Tests: measured, and feasible samples (grey)", **LAYOUT)


def _rounded(amplitude_m: float) -> float:
    """Tests of one amplitude, as it was measured, belong together."""
    return float(f"{amplitude_m:.2g}")


def corner(found: Explored) -> go.Figure:
    """Every pair of parameters: samples that are feasible, and the others; on the diagonal how they are spread."""
    order = np.argsort(-np.abs(found.effects()).max(axis=1))[:_MOST_CORNERS]
    chosen = sorted(int(k) for k in order)
    n = len(chosen)
    figure = make_subplots(rows=n, cols=n, horizontal_spacing=0.03, vertical_spacing=0.03)
    values = found.samples[:, chosen] / found.start[chosen]
    rest, kept = values[~found.feasible][:_SHOWN], values[found.feasible][:_SHOWN]
    edges = np.geomspace(found.asked.low, found.asked.high, 21)
    for i in range(n):
        for j in range(i + 1):
            place = {"row": i + 1, "col": j + 1, "showlegend": False}
            if i == j:
                for group, colour in ((values, _GREY), (values[found.feasible], COLOURS[0])):
                    count = np.histogram(group[:, i], edges)[0]
                    middle = np.sqrt(edges[1:] * edges[:-1])
                    figure.add_scatter(x=middle, y=count, mode="lines", line={"color": colour, "shape": "hvh"}, **place)
                continue
            for group, colour, size in ((rest, _GREY, 3), (kept, COLOURS[0], 5)):
                marker = {"color": colour, "size": size}
                figure.add_scatter(x=group[:, j], y=group[:, i], mode="markers", marker=marker, **place)
            figure.update_yaxes(type="log", row=i + 1, col=j + 1)
    figure.update_xaxes(type="log", range=list(np.log10([found.asked.low, found.asked.high])), **_GRID)
    figure.update_yaxes(**_GRID)
    for i, k in enumerate(chosen):
        figure.update_xaxes(title=found.names[k], row=n, col=i + 1)
        figure.update_yaxes(title=found.names[k] if i else "samples", row=i + 1, col=1)
    title = "Parameters over their start: feasible, others grey"
    return figure.update_layout(height=max(320, 260 * n), title=title, **LAYOUT)


def heat(correlations: Floats, names: tuple[str, ...]) -> go.Figure:
    """Rank correlation of the parameters within the feasible set."""
    cells = go.Heatmap(
        z=correlations, x=names, y=names, zmin=-1.0, zmax=1.0, colorscale=_SCALE, text=np.round(correlations, 2),
        texttemplate="%{text}",
    )  # fmt: skip
    title = "Rank correlation within the feasible set"
    return go.Figure(cells).update_layout(height=160 + 60 * len(names), title=title, **LAYOUT)
