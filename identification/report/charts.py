"""The pictures of a report: each a plotly figure of what its two files hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from identification.report.page_data import (
    GapMap,
    Interval,
    Loop,
    Profile,
    Rivals,
    Shape,
    Spectrum,
    Strengths,
    Words,
)
from identification.report.report_file import BothGaps, Gap, Where

MEASURED, GIVEN, REFITTED, FINAL, NOISE = "#1b1b1b", "#b8b8b8", "#d1495b", "#00798c", "#e0a800"
_WIDE = 15.0  # times the last gap that the first is: beyond it the axis is logarithmic
TEMPLATE = "plotly_white"  # of every figure: whoever shows one puts it in
_LAYOUT = {
    "font": {"family": "system-ui, sans-serif", "size": 13},
    "margin": {"l": 60, "r": 20, "t": 48, "b": 48},
    "legend": {"orientation": "h", "y": -0.18},
}
PANELS = {**_LAYOUT, "margin": {"l": 60, "r": 20, "t": 90, "b": 48}}  # each with a title of its own


def ladder(gaps: BothGaps, train: Interval, held_out: Interval, last: str) -> go.Figure:
    """Gap at each step, training and held-out, with its 95 % interval, against the noise floor.

    `last` names the last step.
    """
    steps = ["as given", "parameters refitted", last]
    figure = go.Figure()
    each = ((gaps.train, train, "training runs", "#9ab7bd"), (gaps.held_out, held_out, "held-out runs", FINAL))
    for gap, ends, label, colour in each:
        values = np.array([gap.as_given, gap.base_refitted, gap.final])
        error = {"type": "data", "symmetric": False, "array": ends.high - values, "arrayminus": values - ends.low,
                 "color": MEASURED, "thickness": 1.2}  # fmt: skip
        figure.add_bar(x=steps, y=values, name=label, offsetgroup=label, marker_color=colour, error_y=error)
        figure.add_scatter(x=steps, y=ends.high, offsetgroup=label, mode="text", text=[f"{v:.3g} N" for v in values],
                           textposition="top center", showlegend=False, hoverinfo="skip")  # fmt: skip
    floor, line = gaps.held_out.noise_floor, {"dash": "dash", "color": NOISE}
    figure.add_hline(y=floor, line=line)
    figure.add_scatter(x=[None], y=[None], name=f"noise floor {floor:.3g} N", mode="lines", line=line)
    figure.update_yaxes(title="rms of measured − simulated, N", type="log" if _wide(gaps.held_out) else "linear")
    figure.update_layout(title="How the gap shrinks, with 95 % intervals", barmode="group", scattermode="group",
                         height=380, **_LAYOUT)  # fmt: skip
    return figure


def _wide(gap: Gap) -> bool:
    return gap.as_given > _WIDE * max(gap.final, 1e-300)


def loops(loop: Loop) -> go.Figure:
    """Force over velocity and over displacement of one run: measured, refitted base, final."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=("force over velocity", "force over displacement"))
    lines = (
        ("measured", loop.measured, MEASURED, 1.0),
        ("base, refitted", loop.refitted, REFITTED, 1.2),
        ("with the named effects", loop.final, FINAL, 1.6),
    )
    axes = ((loop.velocity, "velocity, m/s"), (loop.displacement * 1e3, "displacement, mm"))
    for column, (axis, unit) in enumerate(axes, start=1):
        for name, force, colour, width in lines:
            figure.add_scattergl(
                x=axis, y=force, name=name, legendgroup=name, showlegend=column == 1,
                mode="markers" if name == "measured" else "lines", marker={"size": 2.5, "color": colour},
                line={"width": width, "color": colour}, row=1, col=column,
            )  # fmt: skip
        figure.update_xaxes(title=unit, row=1, col=column)
    figure.update_yaxes(title="force, N", row=1, col=1)
    state = "held out: no fit has seen it" if loop.held_out else "training"
    figure.update_layout(title=f"{loop.run} ({state}){_shown(loop)}", height=470, **PANELS)
    return figure


def _shown(loop: Loop) -> str:
    """Which samples of the run are drawn, where these are not all."""
    part = f"the last {loop.shown} of {loop.samples} samples" if loop.shown < loop.samples else ""
    thinned = f"one in {loop.step} of them" if loop.step > 1 else ""
    words = ", ".join(w for w in (part, thinned) if w)
    return f"<br><sup>{words}</sup>" if words else ""


def spectrum(left: Spectrum) -> go.Figure:
    """Residual spectra of one run, before and after, against the noise floor."""
    figure = go.Figure()
    for name, density, colour in (("base, refitted", left.refitted, REFITTED), ("final", left.final, FINAL)):
        figure.add_scatter(x=left.frequency, y=density, name=name, line={"color": colour, "width": 1.2})
    ends = [float(left.frequency[0]), float(left.frequency[-1])]
    line = {"dash": "dash", "color": NOISE}
    figure.add_scatter(x=ends, y=[left.noise_floor] * 2, name="noise floor", mode="lines", line=line)
    figure.update_xaxes(title="frequency, Hz", type="log")
    figure.update_yaxes(title="residual, N/√Hz", type="log")
    figure.update_layout(title=f"What is left, by frequency: {left.run}", height=380, **_LAYOUT)
    return figure


def profiles(drawn: Sequence[Profile], where: Sequence[Where]) -> go.Figure:
    """Mean residual of the refitted base over every variable, with how far the runs differ as a band, and its rms."""
    columns = 3
    rows = -(-len(drawn) // columns)
    titles = [p.variable.replace("_", " ") for p in drawn]
    figure = make_subplots(rows=rows, cols=columns, subplot_titles=titles, vertical_spacing=0.2)
    regions = {r.variable: r for r in where}
    for k, p in enumerate(drawn):
        row, column = k // columns + 1, k % columns + 1
        scale, unit = (1e3, "mm") if p.unit == "m" else (1.0, p.unit)
        x = p.centre * scale
        figure.add_scatter(
            x=np.concatenate([x, x[::-1]]),
            y=np.concatenate([p.mean + p.band, (p.mean - p.band)[::-1]]),
            fill="toself",
            line={"width": 0},
            fillcolor=REFITTED,
            opacity=0.15,
            hoverinfo="skip",
            name="from run to run",
            showlegend=k == 0,
            legendgroup="band",
            row=row,
            col=column,
        )
        figure.add_scatter(x=x, y=p.rms, line={"width": 1, "color": REFITTED, "dash": "dot"}, name="rms",
                           showlegend=k == 0, legendgroup="rms", row=row, col=column)  # fmt: skip
        figure.add_scatter(x=x, y=p.mean, line={"width": 1.8, "color": REFITTED}, name="mean of measured − simulated",
                           showlegend=k == 0, legendgroup="mean", row=row, col=column)  # fmt: skip
        if p.variable in regions:
            region = regions[p.variable]
            figure.add_vrect(x0=region.low * scale, x1=region.high * scale, fillcolor=NOISE, opacity=0.18, line_width=0,
                             row=row, col=column)  # fmt: skip
        figure.update_xaxes(title=unit, row=row, col=column)
    figure.update_layout(title="Where they disagree: what the refitted base leaves", height=40 + 300 * rows, **PANELS)
    return figure


def map_of_gap(gap: GapMap) -> go.Figure:
    """Mean residual of the refitted base over displacement and velocity, all training runs together."""
    limit = float(np.nanquantile(np.abs(gap.mean), 0.98)) if np.any(np.isfinite(gap.mean)) else 1.0
    figure = go.Figure(
        go.Heatmap(x=gap.displacement * 1e3, y=gap.velocity, z=gap.mean.T, colorscale="RdBu_r", zmin=-limit,
                   zmax=limit, colorbar={"title": "N"})
    )  # fmt: skip
    figure.update_xaxes(title="displacement, mm")
    figure.update_yaxes(title="velocity, m/s")
    figure.update_layout(title="Map of the gap: mean of measured − simulated", height=420, **_LAYOUT)
    return figure


def rivals(panels: Sequence[Rivals], named: Sequence[str], words: Words) -> go.Figure:
    """For each name what its rivals left in its place when last tried; without names, for the first move."""
    titles = [f"in the place of {_place(panel, words)}" for panel in panels]
    figure = make_subplots(rows=len(panels), cols=1, subplot_titles=titles, vertical_spacing=0.36 / len(panels))
    for row, panel in enumerate(panels, start=1):
        figure.add_bar(
            x=panel.left, y=[words.title(n) for n in panel.elements], orientation="h",
            text=[f"{q:.1f} %" for q in panel.left],
            marker_color=[FINAL if n in named else "#c9c9c9" for n in panel.elements], row=row, col=1,
        )  # fmt: skip
        figure.update_xaxes(range=[0.0, 100.0], row=row, col=1)
    figure.update_xaxes(title="share of the gap's energy that is left, %", row=len(panels), col=1)
    bars = sum(len(panel.elements) for panel in panels)
    figure.update_layout(title="What each candidate would leave", height=160 + 70 * len(panels) + 30 * bars,
                         showlegend=False, **PANELS)  # fmt: skip
    return figure


def _place(panel: Rivals, words: Words) -> str:
    beside = f"<br><sup>{panel.beside}</sup>" if panel.beside else ""
    return f"{words.title(panel.place) if panel.place else 'an effect without a name'}{beside}"


def shapes_of_names(found: Sequence[Shape], words: Words) -> go.Figure:
    """For each name the force that is missing without it, what it adds, and what its best rival would add."""
    columns = min(len(found), 2)
    rows = -(-len(found) // columns)
    titles = [f"{words.title(s.name)}{_against(s.rival, words)}" for s in found]
    told: set[str] = set()  # by the legend
    figure = make_subplots(rows=rows, cols=columns, subplot_titles=titles, vertical_spacing=0.34 / rows)
    for k, s in enumerate(found):
        place = {"row": k // columns + 1, "col": k % columns + 1}
        x, unit = (s.centre * 1e3, "mm") if s.unit == "m" else (s.centre, s.unit)
        lines = (
            ("missing without it", s.missing, {"color": MEASURED, "width": 2.5}),
            ("what the name adds", s.own, {"color": FINAL, "width": 2}),
            ("what its best rival would add", s.other, {"color": REFITTED, "width": 1.5, "dash": "dash"}),
        )
        for label, force, line in lines:
            if force is not None:
                figure.add_scatter(x=x, y=force, mode="lines", name=label, legendgroup=label,
                                   showlegend=label not in told, line=line, **place)  # fmt: skip
                told.add(label)
        figure.update_xaxes(title=f"{s.variable.replace('_', ' ')}, {unit}", **place)
        figure.update_yaxes(title="mean force, N", **place)
    layout = {**PANELS, "legend": {"orientation": "h", "y": -0.28 / rows}}
    figure.update_layout(title="What each name adds, where it shows best", height=110 + 330 * rows, **layout)
    return figure


def _against(rival: str | None, words: Words) -> str:
    return "" if rival is None else f"<br><sup>rival: {words.title(rival)}</sup>"


def strengths(found: Strengths, runs: Sequence[str], words: Words) -> go.Figure:
    """Strength of each named effect run by run: a true effect is equally strong in all."""
    figure = go.Figure()
    for element, values in zip(found.elements, found.values, strict=True):
        figure.add_scatter(x=list(runs), y=values, mode="markers", marker={"size": 11}, name=words.title(element))
    figure.add_hline(y=1.0, line_color="#999999")
    figure.update_yaxes(title="strength, relative to the common fit")
    figure.update_layout(title="The same strength in every run?", height=340, **_LAYOUT)
    return figure
