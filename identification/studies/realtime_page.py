"""The page of a run against the clock."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.page_style import COLOURS, document, plots
from identification.studies.page_parts import styled
from identification.studies.realtime import Realtime, realtime_text

_POINTS = 4000  # of the steps; the slowest of each bin is drawn
_SHOWN_S = 0.5  # of the force after a bad input
_BEFORE_S = 0.05


def write_realtime(path: Path, found: Realtime) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(realtime_html(found), encoding="utf-8")


def realtime_html(found: Realtime) -> str:
    """The page as text."""
    return document("Real time", _parts(found))


def _parts(found: Realtime) -> Iterator[str]:
    lines = "".join(f"<li>{escape(line)}</li>" for line in realtime_text(found).splitlines())
    yield f"<h1>Real time: {escape(found.name)}</h1><ul>{lines}</ul>"
    yield from plots((durations(found), shares(found), *(after(found, *bad) for bad in _bad_inputs(found))))
    yield "<p class=note>Measured on the machine that made this page, beside whatever else it did.</p>"


def durations(found: Realtime) -> go.Figure:
    """The duration of the steps in their order; of many the slowest of each bin."""
    size = -(-found.durations_s.size // _POINTS)
    begins = np.arange(0, found.durations_s.size, size)
    slowest = np.maximum.reduceat(found.durations_s, begins)
    figure = go.Figure()
    figure.add_scatter(
        x=begins * found.step_s, y=1e6 * slowest, mode="markers", marker={"color": COLOURS[0], "size": 3},
        name="one step" if size == 1 else f"slowest of {size} steps",
    )  # fmt: skip
    figure.add_scatter(
        x=[0.0, found.durations_s.size * found.step_s], y=[1e6 * found.step_s] * 2, mode="lines", name="the step",
        line={"color": COLOURS[1], "dash": "dash"},
    )  # fmt: skip
    figure.update_xaxes(title="time, s")
    figure.update_yaxes(title="duration, µs", type="log")
    return styled(figure, "Duration of each step")


def shares(found: Realtime) -> go.Figure:
    """The share of steps that took longer than a time."""
    ordered = np.sort(found.durations_s)
    share = 1.0 - np.arange(ordered.size) / ordered.size
    every = np.unique(
        np.append(np.arange(0, ordered.size, max(1, ordered.size // 1000)), ordered.size - 1 - np.arange(20))
    )
    every = every[(every >= 0) & (every < ordered.size)]
    figure = go.Figure(
        go.Scatter(x=1e6 * ordered[every], y=share[every], mode="lines", name="steps", line={"color": COLOURS[0]})
    )
    figure.update_xaxes(title="duration, µs", type="log")
    figure.update_yaxes(title="share of steps as long or longer", type="log")
    return styled(figure, "How many steps take how long")


def _bad_inputs(found: Realtime) -> tuple[tuple[str, int], ...]:
    return (
        ("One step of ten times the motion", found.bad),
        ("One step whose inputs are no numbers", found.no_number),
    )


def after(found: Realtime, title: str, at: int) -> go.Figure:
    """The force around a bad input, beside that without it."""
    first = max(0, at - round(_BEFORE_S / found.step_s))
    shown = slice(first, min(found.force.size, at + round(_SHOWN_S / found.step_s)))
    time = np.arange(found.force.size)[shown] * found.step_s
    figure = go.Figure()
    for name, force, colour in (("disturbed", found.disturbed, COLOURS[1]), ("undisturbed", found.force, COLOURS[0])):
        figure.add_scatter(x=time, y=force[shown], mode="lines", name=name, line={"color": colour, "width": 1.5})
    figure.update_xaxes(title="time, s")
    figure.update_yaxes(title="force, N")
    return styled(figure, f"{title}, at {at * found.step_s:.4g} s")
