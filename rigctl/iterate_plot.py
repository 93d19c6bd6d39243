"""The convergence of a drive-file iteration as one HTML page that opens offline. plotly is imported here only."""

from __future__ import annotations

from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from excitation.atomic import written_whole
from excitation.errors import ExcitationFileError
from rigctl.iterate import Channel, Iterated

__all__ = ["write_convergence"]

SHOWN_SAMPLES = 4000  # of the time histories: around the largest change of the target
UNITS = {Channel.MOTION: ("mm", 1e3), Channel.CURRENT: ("A", 1.0)}
COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728")


def write_convergence(path: Path, name: str, iterated: Iterated) -> None:
    """Write the page: error over rounds, each channel before and after, the rig's response. Whole or not at all.

    Raises ExcitationFileError where the place cannot be written.
    """
    histories = [_history(iterated, number) for number in range(len(iterated.channels))]
    figures = [_errors(iterated), *histories, _response(iterated)]
    parts = [
        figure.to_html(full_html=False, include_plotlyjs=number == 0, default_height="460px")
        for number, figure in enumerate(figures)
    ]
    reached = ", ".join(
        f"{channel} {100 * error:.2f} %" for channel, error in zip(iterated.channels, iterated.best.errors, strict=True)
    )
    title = escape(f"{name}: {iterated.outcome}, {reached} rms")
    page = f'<!doctype html><meta charset="utf-8"><title>{title}</title><h1>{title}</h1>{"".join(parts)}'
    with written_whole(path, ExcitationFileError) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _errors(iterated: Iterated) -> go.Figure:
    """Errors that were measured and that were expected, with what the rounds repeat to."""
    figure, rounds = go.Figure(), list(range(len(iterated.steps)))
    for k, channel in enumerate(iterated.channels):
        measured = [100 * step.errors[k] for step in iterated.steps]
        expected = [None if step.expected is None else 100 * step.expected[k] for step in iterated.steps]
        line = {"color": COLOURS[k]}
        figure.add_scatter(x=rounds, y=measured, name=f"{channel}, measured", mode="lines+markers", line=line)
        figure.add_scatter(
            x=rounds, y=expected, name=f"{channel}, expected", mode="markers", marker={**line, "symbol": "circle-open"}
        )
        if iterated.repeatability[k] > 0:
            figure.add_scatter(
                x=[rounds[0], rounds[-1]],
                y=[100 * iterated.repeatability[k]] * 2,
                name=f"{channel}, difference of two rounds of one drive",
                mode="lines",
                line={**line, "dash": "dash"},
            )
    tolerance = [100 * iterated.settings.tolerance] * 2
    look = {"color": "black", "dash": "dot"}
    figure.add_scatter(x=[rounds[0], rounds[-1]], y=tolerance, name="tolerance", mode="lines", line=look)
    figure.update_layout(title="Error of what was measured, rms over rms of the target")
    figure.update_xaxes(title="round (0: the plain command or the stored drive)", dtick=1)
    figure.update_yaxes(title="%", type="log")
    return figure


def _history(iterated: Iterated, number: int) -> go.Figure:
    """One channel around the largest change of its target."""
    channel, rate = iterated.channels[number], iterated.target.sample_rate_hz
    unit, scale = UNITS[channel]
    wanted = iterated.target.displacement_m if channel is Channel.MOTION else iterated.target.current_a
    assert wanted is not None, "a channel that is iterated has a target"
    target = scale * np.asarray(wanted)
    fastest = int(np.argmax(np.abs(np.diff(target))))
    first = min(max(fastest - SHOWN_SAMPLES // 2, 0), max(target.size - SHOWN_SAMPLES, 0))
    part = slice(first, first + SHOWN_SAMPLES)
    time = (np.arange(target.size) / rate)[part]
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True)
    figure.add_scatter(x=time, y=scale * iterated.best.drive[part, number], name="drive", row=1, col=1)
    figure.add_scatter(x=time, y=target[part], name="wanted", line_dash="dot", row=1, col=1)
    for name, step in (("round 0", iterated.steps[0]), ("best round", iterated.best)):
        error = (scale * step.measured[:, number] - target)[part]
        figure.add_scatter(x=time, y=error, name=f"error, {name}", row=2, col=1)
    figure.update_layout(title=f"{str(channel).capitalize()} around the largest change of its target")
    figure.update_xaxes(title="time, s", row=2, col=1)
    figure.update_yaxes(title=unit)
    return figure


def _response(iterated: Iterated) -> go.Figure:
    """Gain of every pair of channels; phase and coherence of each with its own command."""
    found, channels = iterated.response, iterated.channels
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True)
    pairs = [(i, j) for i in range(len(channels)) for j in range(len(channels))]
    for colour, (i, j) in zip(COLOURS, pairs, strict=False):
        band = (found.frequency_hz > 0) & (found.frequency_hz <= iterated.bandwidth_hz[j])
        f, gain = found.frequency_hz[band], found.gain[band, i, j]
        look = {"line": {"color": colour}, "legendgroup": f"{i}{j}", "col": 1}
        figure.add_scatter(x=f, y=np.abs(gain), name=f"{channels[i]} over {channels[j]} command", row=1, **look)
        if i == j:
            figure.add_scatter(x=f, y=np.degrees(np.angle(gain)), showlegend=False, row=2, **look)
            figure.add_scatter(x=f, y=found.coherence[band, i], showlegend=False, row=3, **look)
    for row, unit in enumerate(("gain", "phase, °", "coherence"), 1):
        figure.update_yaxes(title=unit, row=row, col=1)
    figure.update_layout(title="Frequency response of the rig with the damper in place, relative to the targets' rms")
    figure.update_xaxes(title="frequency, Hz", row=3, col=1)
    return figure
