"""The page of the NARX benchmark: study, evolution, errors and noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from identification.blackbox.evolution import Evolved

Floats = NDArray[np.float64]
_COLOURS = ("#00798c", "#d1495b", "#edae49", "#66a182", "#2e4057")


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What the benchmark found; pairs are errors of the prediction and of the free run, %."""

    inputs: Mapping[tuple[str, int], tuple[float, float]]
    sizes: Mapping[tuple[int, int], tuple[float, float]]
    evolved: list[Evolved]
    errors: Mapping[str, Mapping[str, Floats]]
    noise: Mapping[tuple[str, float], float]


def draw(found: Found, page: Path) -> None:
    """Write the page; it opens offline."""
    titles = (
        "inputs and delays, 15 nodes: prediction", "the same in free run", "nodes and layers: free run",
        "evolution: fitness", "errors on the tests", "noise on one input: prediction",
    )  # fmt: skip
    figure = make_subplots(2, 3, subplot_titles=titles, horizontal_spacing=0.07, vertical_spacing=0.14)
    _study(figure, found)
    _evolution(figure, found.evolved)
    _errors(figure, found.errors)
    for colour, symbol in zip(_COLOURS, "viF", strict=False):
        pairs = [(db, error) for (one, db), error in found.noise.items() if one == symbol]
        _line(figure, pairs, f"noise on {symbol}", colour, 2, 3)
    figure.update_xaxes(title="signal-to-noise ratio, dB", row=2, col=3)
    figure.update_yaxes(title="error, % of the force", type="log", row=2, col=3)
    figure.update_layout(
        template="plotly_white", width=1450, height=980, legend={"orientation": "h", "y": -0.08}, boxmode="group"
    )
    figure.write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


def _study(figure: go.Figure, found: Found) -> None:
    for col in (1, 2):
        for colour, text in zip(_COLOURS, dict.fromkeys(one for one, _ in found.inputs), strict=False):
            pairs = [(d, pair[col - 1]) for (one, d), pair in found.inputs.items() if one == text]
            _line(figure, pairs, f"({', '.join(text)})", colour, 1, col, legend=col == 1)
        figure.update_xaxes(title="delay, samples", row=1, col=col)
        figure.update_yaxes(title="error, % of the force", type="log", row=1, col=col)
    for colour, count in zip(_COLOURS, dict.fromkeys(one for one, _ in found.sizes), strict=False):
        pairs = [(n, pair[1]) for (one, n), pair in found.sizes.items() if one == count]
        _line(figure, pairs, f"{count} hidden layers" if count > 1 else "1 hidden layer", colour, 1, 3)
    figure.update_xaxes(title="nodes of each layer", row=1, col=3)
    figure.update_yaxes(title="error, % of the force", type="log", row=1, col=3)


def _evolution(figure: go.Figure, evolved: list[Evolved]) -> None:
    for k, one in enumerate(evolved):
        for name, series, dash in (("best", one.best, "solid"), ("worst", one.worst, "dot")):
            figure.add_scatter(
                y=series, name=f"{name} of the population", legendgroup=name, showlegend=k == 0,
                line={"color": _COLOURS[0 if name == "best" else 1], "dash": dash, "width": 1.5}, row=2, col=1,
            )  # fmt: skip
    figure.update_xaxes(title="iteration", row=2, col=1)
    figure.update_yaxes(title="rms error of the prediction, scaled", type="log", row=2, col=1)


def _errors(figure: go.Figure, errors: Mapping[str, Mapping[str, Floats]]) -> None:
    for colour, label in zip(_COLOURS, next(iter(errors.values())), strict=False):
        x = np.concatenate([[name] * of[label].size for name, of in errors.items()])
        y = np.concatenate([of[label] for of in errors.values()])
        figure.add_box(x=x, y=y, name=label, marker={"color": colour, "size": 2}, row=2, col=2)
    figure.update_yaxes(title="measured − model, N", row=2, col=2)


def _line(
    figure: go.Figure, pairs: list[tuple[float, float]], name: str, colour: str, row: int, col: int,
    *, legend: bool = True,
) -> None:  # fmt: skip
    figure.add_scatter(
        x=[x for x, _ in pairs], y=[y for _, y in pairs], name=name, legendgroup=name, showlegend=legend,
        mode="lines+markers", line={"color": colour}, row=row, col=col,
    )  # fmt: skip
