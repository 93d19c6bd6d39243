"""The page of the stroke–velocity chart."""

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
from identification.studies.service_range import Covered, Limits, Range, range_text, thinned


def write_range(path: Path, found: Range) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(range_html(found), encoding="utf-8")


def range_html(found: Range) -> str:
    """The page as text."""
    return document("Stroke and velocity", _parts(found))


def _parts(found: Range) -> Iterator[str]:
    lines = "".join(f"<li>{escape(line)}</li>" for line in range_text(found).splitlines())
    yield f"<h1>Service, training and rig</h1><ul>{lines}</ul>"
    # The limits of a rig may be a hundred times the motion, which a chart of its own shows.
    yield from plots([chart(found, limits=False), chart(found)] if found.limits else [chart(found)])
    yield (
        "<p class=note>Stroke is about the mean of each motion. A model is trusted inside what it was trained on: the "
        "training should contain the service, and the rig the training.</p>"
    )


def chart(found: Range, *, limits: bool = True) -> go.Figure:
    """Service and training as points with their hulls, and where asked for the limits as rectangles."""
    figure = go.Figure()
    for k, motion in enumerate((found.service, *found.trained)):
        colour = COLOURS[k % len(COLOURS)]
        name = f"service: {motion.name}" if k == 0 else f"trained on {motion.name}"
        _add_motion(figure, motion, name, colour)
    for k, one in enumerate(found.limits if limits else ()):
        _add_limits(figure, one, COLOURS[-1 - k % len(COLOURS)])
    figure.update_xaxes(title="stroke, mm")
    figure.update_yaxes(title="velocity, m/s")
    return styled(figure, "Stroke and velocity" + (", with the limits" if limits and found.limits else ""), 520)


def _add_motion(figure: go.Figure, motion: Covered, name: str, colour: str) -> None:
    x, v = thinned(motion)
    figure.add_trace(
        go.Scatter(x=1e3 * x, y=v, mode="markers", name=name, marker={"color": colour, "size": 3, "opacity": 0.35})
    )
    hull = np.vstack([motion.hull, motion.hull[:1]])
    figure.add_trace(
        go.Scatter(x=1e3 * hull[:, 0], y=hull[:, 1], mode="lines", line={"color": colour}, showlegend=False, name=name)
    )


def _add_limits(figure: go.Figure, limits: Limits, colour: str) -> None:
    if not np.all(np.isfinite([*limits.stroke, *limits.velocity])):
        for value in (v for v in limits.velocity if np.isfinite(v)):
            figure.add_hline(y=value, line={"color": colour, "dash": "dash"})
        for value in (x for x in limits.stroke if np.isfinite(x)):
            figure.add_vline(x=1e3 * value, line={"color": colour, "dash": "dash"})
        return
    (low, high), (slow, fast) = limits.stroke, limits.velocity
    x = 1e3 * np.array([low, high, high, low, low])
    y = [slow, slow, fast, fast, slow]
    figure.add_trace(go.Scatter(x=x, y=y, mode="lines", name=limits.name, line={"color": colour, "dash": "dash"}))
