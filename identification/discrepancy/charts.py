"""The pictures of a discrepancy report: each a plotly figure made from an explanation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from identification.discrepancy.excess import excess_of
from identification.discrepancy.explanation import Explanation, Traces
from identification.discrepancy.naming import Compared
from identification.discrepancy.shapes import shapes
from identification.physical.elements import CATALOGUE

Floats = NDArray[np.float64]

MEASURED, GIVEN, REFITTED, FINAL, NOISE = "#1b1b1b", "#b8b8b8", "#d1495b", "#00798c", "#e0a800"
_MAX_POINTS = 1500
_LAYOUT = {
    "template": "plotly_white",
    "font": {"family": "system-ui, sans-serif", "size": 13},
    "margin": {"l": 60, "r": 20, "t": 48, "b": 48},
    "legend": {"orientation": "h", "y": -0.18},
}


def ladder(e: Explanation) -> go.Figure:
    """Gap at each step, training and held-out, with its 95 % interval, against the noise floor."""
    steps = ["as given", "parameters refitted", "with the named effects" if e.effects else "final"]
    figure = go.Figure()
    for gaps, label, colour in ((e.train, "training runs", "#9ab7bd"), (e.held_out, "held-out runs", FINAL)):
        traces = [t for t in e.traces if t.held_out == (gaps is e.held_out)]
        values = np.array([gaps.as_given, gaps.base_refitted, gaps.final])
        ends = [interval_of_rms(rests) for rests in zip(*(_rests(t) for t in traces), strict=True)]
        low, high = np.array(ends).T
        error = {"type": "data", "symmetric": False, "array": high - values, "arrayminus": values - low,
                 "color": MEASURED, "thickness": 1.2}  # fmt: skip
        figure.add_bar(x=steps, y=values, name=label, offsetgroup=label, marker_color=colour, error_y=error)
        figure.add_scatter(x=steps, y=high, offsetgroup=label, mode="text", text=[f"{v:.3g} N" for v in values],
                           textposition="top center", showlegend=False, hoverinfo="skip")  # fmt: skip
    floor, line = e.held_out.noise_floor, {"dash": "dash", "color": NOISE}
    figure.add_hline(y=floor, line=line)
    figure.add_scatter(x=[None], y=[None], name=f"noise floor {floor:.3g} N", mode="lines", line=line)
    figure.update_yaxes(title="rms of measured − simulated, N", type="log" if _wide(e) else "linear")
    figure.update_layout(title="How the gap shrinks, with 95 % intervals", barmode="group", scattermode="group",
                         height=380, **_LAYOUT)  # fmt: skip
    return figure


def _rests(t: Traces) -> list[list[Floats]]:
    """What each step leaves of a record, N, in stretches of a period, or a tenth of a record that has none."""
    size = t.record.measured.size
    cuts = np.arange(0, size, t.record.period or -(-size // 10))[1:]
    return [np.split(t.record.measured - force, cuts) for force in (t.as_given, t.refitted, t.final)]


def interval_of_rms(rests: Sequence[Sequence[Floats]]) -> tuple[float, float]:
    """95 % interval of the rms over all stretches of all records, from the scatter of its square between them."""
    stretches = [e for record in rests for e in record]
    energy, size = (np.array([f(e) for e in stretches]) for f in (lambda e: float(np.sum(e**2)), len))
    mean = float(np.sum(energy) / np.sum(size))
    few = energy.size / max(energy.size - 1, 1)
    half = 1.96 * float(np.sqrt(few * np.sum((energy - mean * size) ** 2)) / np.sum(size))
    return float(np.sqrt(max(mean - half, 0.0))), float(np.sqrt(mean + half))


def _wide(e: Explanation) -> bool:
    return e.held_out.as_given > 15.0 * max(e.held_out.final, 1e-300)


def loops(trace: Traces) -> go.Figure:
    """Force over velocity and over displacement of one run: measured, refitted base, final."""
    record = trace.record
    keep = _last_stretch(record.measured.size, record.period)
    v, x = record.motion.v[record.window][keep], record.motion.x[record.window][keep]
    figure = make_subplots(rows=1, cols=2, subplot_titles=("force over velocity", "force over displacement"))
    lines = (
        ("measured", record.measured, MEASURED, 1.0),
        ("base, refitted", trace.refitted, REFITTED, 1.2),
        ("with the named effects", trace.final, FINAL, 1.6),
    )
    for column, (axis, scale, unit) in enumerate(((v, 1.0, "velocity, m/s"), (x, 1e3, "displacement, mm")), start=1):
        for name, force, colour, width in lines:
            figure.add_scattergl(
                x=axis * scale, y=force[keep], name=name, legendgroup=name, showlegend=column == 1,
                mode="markers" if name == "measured" else "lines", marker={"size": 2.5, "color": colour},
                line={"width": width, "color": colour}, row=1, col=column,
            )  # fmt: skip
        figure.update_xaxes(title=unit, row=1, col=column)
    figure.update_yaxes(title="force, N", row=1, col=1)
    state = "held out: no fit has seen it" if trace.held_out else "training"
    figure.update_layout(title=f"{record.name} ({state})", height=430, **_LAYOUT)
    return figure


def _last_stretch(size: int, period: int) -> NDArray[np.int64]:
    """The last period, or the last samples, thinned to what a screen can show."""
    span = min(size, max(period, 200) if period else 3000)
    return np.arange(size - span, size, max(1, span // _MAX_POINTS))


def spectrum(traces: Sequence[Traces]) -> go.Figure:
    """Residual spectra of the held-out run with the largest gap, before and after, against the noise floor."""
    trace = max(traces, key=lambda t: float(np.mean((t.record.measured - t.refitted) ** 2)))
    r = trace.record
    figure = go.Figure()
    for name, force, colour in (("base, refitted", trace.refitted, REFITTED), ("final", trace.final, FINAL)):
        frequency, density = _density(r.measured - force, r.dt)
        figure.add_scatter(x=frequency, y=density, name=name, line={"color": colour, "width": 1.2})
    floor = r.sigma * np.sqrt(2.0 * r.dt)
    ends = [float(frequency[0]), float(frequency[-1])]
    line = {"dash": "dash", "color": NOISE}
    figure.add_scatter(x=ends, y=[floor, floor], name="noise floor", mode="lines", line=line)
    figure.update_xaxes(title="frequency, Hz", type="log")
    figure.update_yaxes(title="residual, N/√Hz", type="log")
    figure.update_layout(title=f"What is left, by frequency: {r.name}", height=380, **_LAYOUT)
    return figure


def _density(residual: Floats, dt: float) -> tuple[Floats, Floats]:
    """Amplitude density of a residual, averaged over logarithmic bands."""
    power = np.abs(np.fft.rfft(residual * np.hanning(residual.size))) ** 2 * 2.0 * dt / (0.375 * residual.size)
    frequency = np.fft.rfftfreq(residual.size, dt)
    edges = np.unique(
        np.geomspace(2, power.size, 160).astype(np.int64)
    )  # below it lies the mean, which no run resolves
    starts = edges[:-1]
    counts = np.diff(edges)
    mean = np.add.reduceat(power[: edges[-1]], starts) / counts
    centre = np.add.reduceat(frequency[: edges[-1]], starts) / counts
    return centre, np.sqrt(mean)


def profiles(e: Explanation) -> go.Figure:
    """Mean residual of the refitted base over every variable, with how far the runs differ as a band, and its rms."""
    wanted = [p for p in e.profiles if p.variable not in ("speed", "stroke")]
    columns = 3
    rows = -(-len(wanted) // columns)
    titles = [p.variable.replace("_", " ") for p in wanted]
    figure = make_subplots(rows=rows, cols=columns, subplot_titles=titles, vertical_spacing=0.16)
    regions = {r.variable: r for r in e.where}
    for k, p in enumerate(wanted):
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
    figure.update_layout(title="Where they disagree: what the refitted base leaves", height=300 * rows, **_LAYOUT)
    return figure


def map_of_gap(e: Explanation) -> go.Figure:
    """Mean residual of the refitted base over displacement and velocity, all training runs together."""
    chosen = [t for t in e.traces if not t.held_out]
    x = np.concatenate([t.record.motion.x[t.record.window] for t in chosen]) * 1e3
    v = np.concatenate([t.record.motion.v[t.record.window] for t in chosen])
    rest = np.concatenate([t.record.measured - t.refitted for t in chosen])
    edges = [np.linspace(float(np.quantile(a, 0.001)), float(np.quantile(a, 0.999)), 41) for a in (x, v)]
    total, _, _ = np.histogram2d(x, v, edges, weights=rest)
    count, _, _ = np.histogram2d(x, v, edges)
    mean = np.where(count > 3, total / np.maximum(count, 1.0), np.nan)
    limit = float(np.nanquantile(np.abs(mean), 0.98))
    centres = [0.5 * (q[1:] + q[:-1]) for q in edges]
    figure = go.Figure(
        go.Heatmap(x=centres[0], y=centres[1], z=mean.T, colorscale="RdBu_r", zmin=-limit, zmax=limit,
                   colorbar={"title": "N"})
    )  # fmt: skip
    figure.update_xaxes(title="displacement, mm")
    figure.update_yaxes(title="velocity, m/s")
    figure.update_layout(title="Map of the gap: mean of measured − simulated", height=420, **_LAYOUT)
    return figure


def rivals(e: Explanation) -> go.Figure | None:
    """For each name what its rivals left in its place when last tried; without names, for the first move."""
    panels = {
        f"{CATALOGUE[n].title}<br><sup>{beside(c)}</sup>": (c.rivals, excess_of(c.start)) for n, c in e.compared.items()
    }
    if not panels and e.moves:
        panels = {"an effect without a name": (e.moves[0].rivals, e.moves[0].excess_before)}
    if not panels:
        return None
    titles = [f"in the place of {title}" for title in panels]
    figure = make_subplots(rows=len(panels), cols=1, subplot_titles=titles, vertical_spacing=0.36 / len(panels))
    for row, (tried, before) in enumerate(panels.values(), start=1):
        ranked = sorted((t for t in tried if t.excess < before), key=lambda t: t.excess, reverse=True)
        left = [100.0 * max(t.excess, 0.0) / before for t in ranked]
        figure.add_bar(
            x=left, y=[CATALOGUE[t.name].title for t in ranked], orientation="h", text=[f"{q:.1f} %" for q in left],
            marker_color=[FINAL if t.name in e.compared else "#c9c9c9" for t in ranked], row=row, col=1,
        )  # fmt: skip
        figure.update_xaxes(range=[0.0, 100.0], row=row, col=1)
    figure.update_xaxes(title="share of the gap's energy that is left, %", row=len(panels), col=1)
    bars = sum(len(tried) for tried, _ in panels.values())
    layout = {**_LAYOUT, "margin": {"l": 60, "r": 20, "t": 90, "b": 48}}
    figure.update_layout(title="What each candidate would leave", height=160 + 70 * len(panels) + 30 * bars,
                         showlegend=False, **layout)  # fmt: skip
    return figure


def beside(compared: Compared) -> str:
    """What stood beside a name when it was compared with its rivals."""
    return f"beside {', '.join(CATALOGUE[n].title for n in compared.beside) or 'the base alone'}"


def shapes_of_names(e: Explanation) -> go.Figure | None:
    """For each name the force that is missing without it, what it adds, and what its best rival would add."""
    found = shapes(e)
    if not found:
        return None
    columns = min(len(found), 2)
    rows = -(-len(found) // columns)
    titles = [f"{CATALOGUE[s.name].title}{_against(s.rival)}" for s in found]
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
    layout = {
        **_LAYOUT,
        "margin": {"l": 60, "r": 20, "t": 90, "b": 48},
        "legend": {"orientation": "h", "y": -0.28 / rows},
    }
    figure.update_layout(title="What each name adds, where it shows best", height=110 + 330 * rows, **layout)
    return figure


def _against(rival: str | None) -> str:
    return "" if rival is None else f"<br><sup>rival: {CATALOGUE[rival].title}</sup>"


def strengths(e: Explanation) -> go.Figure | None:
    """Strength of each named effect run by run: a true effect is equally strong in all."""
    with_evidence = [f for f in e.effects if f.evidence is not None]
    if not with_evidence:
        return None
    names = [t.record.name for t in e.traces if not t.held_out]
    figure = go.Figure()
    for f in with_evidence:
        assert f.evidence is not None
        figure.add_scatter(x=names, y=f.evidence.strengths, mode="markers", marker={"size": 11},
                           name=CATALOGUE[f.element].title)  # fmt: skip
    figure.add_hline(y=1.0, line_color="#999999")
    figure.update_yaxes(title="strength, relative to the common fit")
    figure.update_layout(title="The same strength in every run?", height=340, **_LAYOUT)
    return figure
