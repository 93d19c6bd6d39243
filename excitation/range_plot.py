"""Chart of the working range: how densely it is filled, within what is asked for and what can be achieved."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from excitation.configuration import to_spec
from excitation.motion import Motion
from excitation.multisine_spec import MultisineSpec
from excitation.response import gains
from excitation.signal import Excitation

__all__ = ["range_map"]

_CELLS = 20  # of the map along each axis
_SCALES: Mapping[str, tuple[float, str]] = {
    "displacement": (1e3, "displacement (mm)"),
    "velocity": (1e3, "velocity (mm/s)"),
    "acceleration": (1.0, "acceleration (m/s²)"),
    "current": (1.0, "current (A)"),
}


def range_map(excitation: Excitation, moved: Motion) -> go.Figure | None:
    """Samples over the first two covered variables, against an even filling of the achievable range: 1 is even.

    None where the design states no ranges.
    """
    figures = excitation.figures
    names, reachable = figures.get("coverage_variables"), figures.get("achievable_range")
    if not isinstance(names, (list, tuple)) or not isinstance(reachable, Mapping):
        return None
    x, y = (str(name) for name in names[:2])
    values = [_SCALES[name][0] * u for name, u in zip((x, y), received(excitation, moved, (x, y)), strict=True)]
    wanted = figures.get("asked_range")
    shown = wanted if isinstance(wanted, Mapping) else reachable
    edges = [_cells(_ends(shown, name)) for name in (x, y)]
    counts, *_ = np.histogram2d(values[0], values[1], bins=edges)
    figure = go.Figure(
        go.Heatmap(
            x=0.5 * (edges[0][1:] + edges[0][:-1]),
            y=0.5 * (edges[1][1:] + edges[1][:-1]),
            z=(counts / (values[0].size * _share_of_a_cell(reachable, edges, x, y))).T,
            zmin=0.0,
            zmax=2.0,
            colorscale="Viridis",
            colorbar={"title": "filling / even"},
        )
    )
    _outline(figure, reachable, x, y, "achievable", "orange")
    if isinstance(wanted, Mapping):
        _outline(figure, wanted, x, y, "asked for", "red")
    figure.update_xaxes(title_text=_SCALES[x][1])
    figure.update_yaxes(title_text=_SCALES[y][1])
    where = " at the damper" if "coverage_at_damper" in figures else ""
    title = f"Working range{where}: D = {_number(figures['coverage_achievable'])} % over what can be achieved"
    if isinstance(wanted, Mapping):
        title += f", {_number(figures['coverage_asked'])} % over what is asked for"
    return figure.update_layout(title=title, legend={"orientation": "h", "y": -0.2})


def _cells(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges of cells over an interval and a twentieth more on either side."""
    low, high = float(ends[0]), float(ends[1])
    return np.linspace(1.05 * low - 0.05 * high, 1.05 * high - 0.05 * low, _CELLS + 1)


def received(excitation: Excitation, moved: Motion, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """The variables of one period as the damper gets them, each (N,)."""
    commanded = {
        "displacement": moved.displacement_m,
        "velocity": moved.velocity_m_s,
        "acceleration": moved.acceleration_m_s2,
        "current": moved.current_a,
    }
    config = {key: value for key, value in excitation.design.items() if key != "kind"}
    response = to_spec(MultisineSpec, config).response
    made = []
    for name in names:
        values = commanded[name]
        assert values is not None  # what is covered is part of the design
        known = None if response is None else response.current if name == "current" else response.displacement
        if known is not None:
            spectrum = np.fft.rfft(values)
            lines = np.flatnonzero(np.abs(spectrum[1:]) > 1e-9 * np.abs(spectrum[1:]).max()) + 1
            gain, turns = gains(known, lines.astype(np.float64) * (moved.sample_rate_hz / values.size))
            spectrum[lines] *= gain * np.exp(2j * np.pi * turns)
            values = np.fft.irfft(spectrum, n=values.size)
        made.append(values)
    return made


def _ends(region: Mapping[str, object], name: str) -> NDArray[np.float64]:
    """The interval of a variable, in the chart's unit."""
    return _SCALES[name][0] * np.asarray(region[name], dtype=np.float64)


def _is_ellipse(region: Mapping[str, object], x: str, y: str) -> bool:
    pair = region.get("ellipse")
    return isinstance(pair, (list, tuple)) and {x, y} == set(pair)


def _share_of_a_cell(region: Mapping[str, object], edges: list[NDArray[np.float64]], x: str, y: str) -> float:
    """Area of a cell of the map over the area of the region."""
    cell = float((edges[0][1] - edges[0][0]) * (edges[1][1] - edges[1][0]))
    area = float(np.ptp(_ends(region, x)) * np.ptp(_ends(region, y)))
    return cell / (area * (0.25 * np.pi if _is_ellipse(region, x, y) else 1.0))


def _outline(figure: go.Figure, region: Mapping[str, object], x: str, y: str, name: str, colour: str) -> None:
    (left, right), (low, high) = _ends(region, x), _ends(region, y)
    if _is_ellipse(region, x, y):
        turn = np.linspace(0.0, 2.0 * np.pi, 181)
        across = 0.5 * (left + right) + 0.5 * (right - left) * np.cos(turn)
        up = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(turn)
    else:
        across, up = np.array([left, right, right, left, left]), np.array([low, low, high, high, low])
    line = {"color": colour, "width": 2, "dash": "solid" if name == "achievable" else "dot"}
    figure.add_trace(go.Scatter(x=across, y=up, mode="lines", line=line, name=name))


def _number(value: object) -> str:
    return f"{float(str(value)):.3g}"
