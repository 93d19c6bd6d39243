"""The convergence of a drive-file iteration as one HTML page that opens is_off. plotly is imported here only."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from excitation.atomic import written_whole
from excitation.errors import ExcitationFileError
from rigctl.iterate import Iterated

__all__ = ["write_convergence"]

SHOWN_SAMPLES = 4000  # of the time histories: around the largest velocity


def write_convergence(path: Path, name: str, iterated: Iterated) -> None:
    """Write the page: error over iterations, motion before and after, the rig's response. Whole or not at all.

    Raises ExcitationFileError where the place cannot be written.
    """
    figures = [_errors(iterated), _motion(iterated), _response(iterated)]
    parts = [
        figure.to_html(full_html=False, include_plotlyjs=number == 0, default_height="420px")
        for number, figure in enumerate(figures)
    ]
    title = escape(f"{name}: {iterated.outcome}, {100 * iterated.best.error:.2f} % rms")
    page = f'<!doctype html><meta charset="utf-8"><title>{title}</title><h1>{title}</h1>{"".join(parts)}'
    with written_whole(path, ExcitationFileError) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _errors(iterated: Iterated) -> go.Figure:
    figure = go.Figure(
        go.Scatter(y=[100 * step.error for step in iterated.steps], mode="lines+markers", name="measured − wanted")
    )
    figure.add_hline(y=100 * iterated.settings.tolerance, line_dash="dot", annotation_text="wanted")
    figure.update_layout(title="Error of the measured displacement, rms over rms of the target")
    figure.update_xaxes(title="iteration (0: the plain command)", dtick=1)
    figure.update_yaxes(title="%", type="log")
    return figure


def _motion(iterated: Iterated) -> go.Figure:
    target, rate = iterated.target.displacement_m, iterated.target.sample_rate_hz
    fastest = int(np.argmax(np.abs(np.diff(target))))
    first = min(max(fastest - SHOWN_SAMPLES // 2, 0), max(target.size - SHOWN_SAMPLES, 0))
    part = slice(first, first + SHOWN_SAMPLES)
    time = (np.arange(target.size) / rate)[part]
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True)
    figure.add_scatter(x=time, y=1e3 * target[part], name="wanted", row=1, col=1)
    figure.add_scatter(x=time, y=1e3 * iterated.best.drive_m[part], name="drive", row=1, col=1)
    for name, step in (("plain command", iterated.steps[0]), ("iterated", iterated.best)):
        error = 1e3 * (step.measured_m - target)[part]
        figure.add_scatter(x=time, y=error, name=f"error, {name}", row=2, col=1)
    figure.update_layout(title="Motion around the largest velocity")
    figure.update_xaxes(title="time, s", row=2, col=1)
    figure.update_yaxes(title="mm")
    return figure


def _response(iterated: Iterated) -> go.Figure:
    found = iterated.response
    band = (found.frequency_hz > 0) & (found.frequency_hz <= iterated.bandwidth_hz)
    f, gain = found.frequency_hz[band], found.gain[band]
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True)
    for row, (unit, values) in enumerate(
        (("gain", np.abs(gain)), ("phase, °", np.degrees(np.angle(gain))), ("coherence", found.coherence[band])), 1
    ):
        figure.add_scatter(x=f, y=values, name=unit, row=row, col=1)
        figure.update_yaxes(title=unit, row=row, col=1)
    figure.update_layout(title="Frequency response of the rig with the damper in place", showlegend=False)
    figure.update_xaxes(title="frequency, Hz", row=3, col=1)
    return figure
