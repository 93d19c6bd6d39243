"""Charts of an excitation or a plan, as one HTML page that opens offline. plotly is imported here only."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from excitation.atomic import written_whole
from excitation.coverage import coverage, cumulative_distribution
from excitation.envelope import temperatures
from excitation.errors import ExcitationFileError
from excitation.kinds import HOMOGENISED, Kind
from excitation.motion import Motion, motion
from excitation.plan import TestPlan
from excitation.prediction import ForceModel, predict, specimen_force
from excitation.range_plot import range_map
from excitation.rig import Envelope, MotionLimits
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config

__all__ = [
    "coverage_map",
    "distribution_plot",
    "figures",
    "force_velocity_reach",
    "plan_overview",
    "service_chart",
    "signals_plot",
    "spectrum_plot",
    "stroke_velocity_plot",
    "write_plots",
]

_MOST_POINTS = 20_000  # of one trace: more slow a browser down and show nothing more
_MM, _MM_S = 1e3, 1e3
_UNLIMITED = Envelope(motion=MotionLimits(max_displacement_m=1e9, max_velocity_m_s=1e9))


def write_plots(
    path: Path | str,
    made: Excitation | TestPlan,
    envelope: Envelope | None = None,
    force_model: ForceModel | None = None,
) -> None:
    """One page with every chart that applies; written whole or not at all.

    Raises ExcitationFileError where the place cannot be written.
    """
    path = Path(path)
    drawn = figures(made, envelope, force_model)
    with written_whole(path, ExcitationFileError) as temporary:
        temporary.write_text(_page(path.stem, drawn), encoding="utf-8")


def figures(
    made: Excitation | TestPlan, envelope: Envelope | None = None, force_model: ForceModel | None = None
) -> list[go.Figure]:
    """Every chart that applies."""
    if isinstance(made, TestPlan):
        return [plan_overview(made, envelope)]
    return _of_excitation(made, envelope, force_model)


def _of_excitation(
    excitation: Excitation, envelope: Envelope | None, force_model: ForceModel | None
) -> list[go.Figure]:
    moved = motion(excitation)
    drawn = [signals_plot(moved), spectrum_plot(moved), distribution_plot(moved), stroke_velocity_plot(moved)]
    if moved.current_a is not None and np.ptp(moved.current_a) > 0:
        drawn.append(coverage_map(moved, _grid(excitation)))
        before = _before(excitation)
        if before is not None:
            drawn.append(coverage_map(before, _grid(excitation), " before, with random phases"))
    working_range = range_map(excitation, moved)
    if working_range is not None:
        drawn.append(working_range)
    if "service_outline" in excitation.figures:
        drawn.append(service_chart(excitation))
    if force_model is not None or (envelope is not None and envelope.specimen is not None):
        drawn.append(force_velocity_reach(moved, envelope, force_model))
    return drawn


def _grid(excitation: Excitation) -> tuple[int, int]:
    grid = excitation.figures.get("coverage_grid")
    known = isinstance(grid, (list, tuple)) and len(grid) == 2
    return (int(str(grid[0])), int(str(grid[1]))) if known else (10, 10)  # type: ignore[index]


def signals_plot(moved: Motion) -> go.Figure:
    """Displacement, velocity, acceleration and current over one period."""
    rows: list[tuple[str, NDArray[np.float64]]] = [
        ("displacement (mm)", _MM * moved.displacement_m),
        ("velocity (mm/s)", _MM_S * moved.velocity_m_s),
        ("acceleration (m/s²)", moved.acceleration_m_s2),
    ]
    if moved.current_a is not None:
        rows.append(("current (A)", moved.current_a))
    every = _every(moved.displacement_m)
    time = np.arange(moved.displacement_m.size)[::every] / moved.sample_rate_hz
    figure = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    for number, (name, values) in enumerate(rows, start=1):
        figure.add_trace(go.Scattergl(x=time, y=values[::every], name=name, mode="lines"), row=number, col=1)
        figure.update_yaxes(title_text=name, row=number, col=1)
    figure.update_xaxes(title_text="time (s)", row=len(rows), col=1)
    return figure.update_layout(
        title="One period" if moved.repeats > 1.0 else "The whole", height=220 * len(rows), showlegend=False
    )


def spectrum_plot(moved: Motion) -> go.Figure:
    """Amplitude of each DFT line of displacement, velocity and current, both axes logarithmic."""
    figure = go.Figure()
    rows: list[tuple[str, NDArray[np.float64] | None]] = [
        ("displacement (mm)", _MM * moved.displacement_m),
        ("velocity (mm/s)", _MM_S * moved.velocity_m_s),
        ("current (A)", moved.current_a),
    ]
    for name, values in rows:
        if values is None or np.ptp(values) == 0.0:
            continue
        amplitude = 2.0 / values.size * np.abs(np.fft.rfft(values))[1:]
        frequency = np.arange(1, amplitude.size + 1) * moved.sample_rate_hz / values.size
        shown = amplitude > 1e-9 * amplitude.max()
        figure.add_trace(
            go.Scattergl(x=frequency[shown], y=amplitude[shown], name=name, mode="markers+lines", marker={"size": 3})
        )
    figure.update_xaxes(type="log", title_text="frequency (Hz)")
    figure.update_yaxes(type="log", title_text="amplitude")
    return figure.update_layout(title="Amplitude spectrum")


def distribution_plot(moved: Motion) -> go.Figure:
    """Cumulative distribution of velocity and current over their reach; the straight line is uniform."""
    figure = go.Figure()
    rows = (("displacement", moved.displacement_m), ("velocity", moved.velocity_m_s), ("current", moved.current_a))
    for name, values in rows:
        if values is None or np.ptp(values) == 0.0:
            continue
        ordered, share = cumulative_distribution(values)
        every = _every(ordered)
        place = (ordered[::every] - ordered[0]) / (ordered[-1] - ordered[0])
        figure.add_trace(go.Scatter(x=place, y=share[::every], name=name, mode="lines"))
    figure.add_trace(
        go.Scatter(x=[0, 1], y=[0, 1], name="uniform", mode="lines", line={"dash": "dot", "color": "grey"})
    )
    figure.update_xaxes(title_text="place between smallest and largest value")
    figure.update_yaxes(title_text="share of samples at or below")
    return figure.update_layout(title="Cumulative distribution")


def _before(excitation: Excitation) -> Motion | None:
    """A homogenised design with the random phases that it started from."""
    if excitation.design.get("kind") != HOMOGENISED:
        return None
    return motion(excitation_from_config({**excitation.design, "kind": str(Kind.MULTISINE)}))


def coverage_map(moved: Motion, grid: tuple[int, int] = (10, 10), note: str = "") -> go.Figure:
    """Samples in each cell of velocity × current, against the mean: 1 everywhere is uniform."""
    if moved.current_a is None:
        return stroke_velocity_plot(moved)
    covered = coverage([moved.velocity_m_s, moved.current_a], grid)
    filling = covered.counts / covered.counts.mean()
    velocity, current = covered.edges
    figure = go.Figure(
        go.Heatmap(
            x=_MM_S * 0.5 * (velocity[1:] + velocity[:-1]),
            y=0.5 * (current[1:] + current[:-1]),
            z=filling.T,
            zmin=0.0,
            zmax=2.0,
            colorscale="Viridis",
            colorbar={"title": "filling / mean"},
        )
    )
    figure.update_xaxes(title_text="velocity (mm/s)")
    figure.update_yaxes(title_text="current (A)")
    return figure.update_layout(
        title=f"Coverage of velocity × current{note}: D = {covered.index:.3g} %, normalised {covered.normalised:.3g} %"
    )


def stroke_velocity_plot(moved: Motion) -> go.Figure:
    """The path in the plane of stroke and velocity."""
    every = _every(moved.displacement_m)
    figure = go.Figure(
        go.Scattergl(
            x=_MM * moved.displacement_m[::every],
            y=_MM_S * moved.velocity_m_s[::every],
            mode="markers",
            marker={"size": 2},
            name="training",
        )
    )
    figure.update_xaxes(title_text="displacement (mm)")
    figure.update_yaxes(title_text="velocity (mm/s)")
    return figure.update_layout(title="Stroke and velocity")


def service_chart(excitation: Excitation) -> go.Figure:
    """Training points and the outline of the service record in the plane of stroke and velocity."""
    figure = stroke_velocity_plot(motion(excitation))
    outline = excitation.figures["service_outline"]
    share = excitation.figures["service_contained"]
    x = np.asarray(outline["displacement"], dtype=np.float64)  # type: ignore[index, call-overload]
    v = np.asarray(outline["velocity"], dtype=np.float64)  # type: ignore[index, call-overload]
    figure.add_trace(
        go.Scatter(x=_MM * np.append(x, x[0]), y=_MM_S * np.append(v, v[0]), mode="lines", name="service record")
    )
    return figure.update_layout(title=f"The training range contains {100 * float(str(share)):.4g} % of the service")


def force_velocity_reach(
    moved: Motion, envelope: Envelope | None = None, force_model: ForceModel | None = None
) -> go.Figure:
    """Predicted force over velocity, within the rig's force and speed."""
    force = specimen_force(moved, None if envelope is None else envelope.specimen, force_model)
    figure = go.Figure()
    if force is not None:
        every = _every(force)
        points = go.Scattergl(
            x=_MM_S * moved.velocity_m_s[::every],
            y=1e-3 * force[::every],
            mode="markers",
            marker={"size": 2},
            name="predicted",
        )
        figure.add_trace(points)
    if envelope is not None and envelope.force is not None:
        speed, limit = _MM_S * envelope.motion.max_velocity_m_s, 1e-3 * envelope.force.dynamic_n
        box = go.Scatter(
            x=[-speed, speed, speed, -speed, -speed],
            y=[-limit, -limit, limit, limit, -limit],
            mode="lines",
            name="rig",
        )
        figure.add_trace(box)
    figure.update_xaxes(title_text="velocity (mm/s)")
    figure.update_yaxes(title_text="force (kN)")
    return figure.update_layout(title="Force-velocity reach, predicted")


def plan_overview(plan: TestPlan, envelope: Envelope | None = None) -> go.Figure:
    """Each test's amplitude, frequency and place in the order; below, speed and predicted temperature."""
    rig = envelope or _UNLIMITED
    predicted = tuple(predict(test.excitation, rig) for test in plan.tests)
    names = [test.name for test in plan.tests]
    order = list(range(1, len(names) + 1))
    celsius = temperatures(plan, predicted, rig)
    rows = 3 if np.isfinite(celsius).all() else 2
    figure = make_subplots(rows=rows, cols=1)
    where = go.Scatter(
        x=[p.highest_frequency_hz for p in predicted],
        y=[_MM * p.displacement_m for p in predicted],
        mode="markers",
        hovertext=names,
        marker={"color": order, "colorscale": "Viridis", "colorbar": {"title": "order", "len": 1.0 / rows, "y": 0.85}},
    )
    figure.add_trace(where, row=1, col=1)
    figure.update_xaxes(type="log", title_text="highest frequency (Hz)", row=1, col=1)
    figure.update_yaxes(type="log", title_text="peak displacement (mm)", row=1, col=1)
    below: list[tuple[str, Sequence[float]]] = [
        ("peak velocity (mm/s)", [_MM_S * p.velocity_m_s for p in predicted]),
        ("damper at the end (°C)", celsius),
    ]
    for row, (name, values) in enumerate(below[: rows - 1], start=2):
        figure.add_trace(go.Bar(x=order, y=values, hovertext=names), row=row, col=1)
        figure.update_yaxes(title_text=name, row=row, col=1)
        figure.update_xaxes(title_text="test, in playing order", row=row, col=1)
    minutes = plan.duration_s / 60.0
    return figure.update_layout(title=f"{len(names)} tests, {minutes:.3g} min", height=350 * rows, showlegend=False)


def _every(values: NDArray[np.float64]) -> int:
    return max(1, values.size // _MOST_POINTS)


def _page(title: str, figures: Sequence[go.Figure]) -> str:
    """plotly's own JavaScript goes in once, with the first chart."""
    parts = [
        figure.update_layout(template="plotly_white").to_html(full_html=False, include_plotlyjs=number == 0)
        for number, figure in enumerate(figures)
    ]
    head = f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title></head>'
    return f"{head}<body>{''.join(parts)}</body></html>\n"
