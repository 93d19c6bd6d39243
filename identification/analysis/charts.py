"""The pictures of an analysis: each a plotly figure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from excitation.analysis import Analysis, Level, Levels, Response
from identification.page_style import CLEAR, COLOURS, LAYOUT

__all__ = [
    "charts",
    "coherence",
    "force_spectrum",
    "log_axis",
    "over_levels",
    "over_time",
    "own_charts",
    "response",
    "responses",
]

Floats = NDArray[np.float64]

_LOWEST = 0.1  # of a magnitude: a lower end of its band is not drawn on the logarithmic axis
_POINTS = 4000  # of a curve: a screen shows no more
_DECADES = 4  # of an axis: three marks in each have room up to here
_EACH = 20  # periods: so many have a mark each
_KINDS = {
    "force": ("force on the driven lines", COLOURS[3], "circle"),
    "odd": ("odd distortion", COLOURS[1], "triangle-up"),
    "even": ("even distortion", COLOURS[2], "square"),
    "odd and even": ("odd and even distortion", COLOURS[5], "diamond"),
    "noise": ("noise of the mean period", COLOURS[7], "circle"),
}
_TITLES = {
    "displacement": ("Force over displacement: dynamic stiffness", "N/m"),
    "velocity": ("Force over velocity: damping", "N·s/m"),
    "current": ("Force over current", "N/A"),
}


def charts(found: Analysis) -> list[go.Figure]:
    """All figures, in the order of the page."""
    first, *rest = own_charts(found)
    order = {"velocity": 0, "displacement": 1}
    linear = [response(one) for one in sorted(found.responses, key=lambda one: order.get(one.over, 2))]
    return [first, *linear, *rest]


def own_charts(found: Analysis) -> list[go.Figure]:
    """What is drawn for each level by itself: spectrum, coherence, change over the run."""
    out = [force_spectrum(found), coherence(found)]
    return [*out, over_time(found)] if found.variation.trends else out


def force_spectrum(found: Analysis) -> go.Figure:
    """Rms of the force on each line: what is driven, odd and even distortion beside it, and noise."""
    figure = go.Figure()
    for one in found.spectrum:
        name, colour, symbol = _KINDS[one.kind]
        label = name if one.kind == "noise" else f"{name}, level without noise"
        every = _every(one.rms)
        if one.kind != "noise":
            figure.add_scattergl(
                x=one.frequency_hz[every], y=_shown(one.rms[every]), mode="markers", name=name, legendgroup=one.kind,
                marker={"size": 5, "color": colour, "symbol": symbol, "opacity": 0.55},
            )  # fmt: skip
        if one.kind != "force":
            figure.add_scatter(
                x=one.frequency_hz[every], y=_shown(one.smooth[every]), mode="lines", legendgroup=one.kind,
                name=label, line={"color": colour, "width": 2},
            )  # fmt: skip
    frequencies, forces = (_all(getattr(one, name) for one in found.spectrum) for name in ("frequency_hz", "rms"))
    figure.update_xaxes(title="frequency, Hz", **log_axis(frequencies))
    figure.update_yaxes(title="force on a line, N rms", **log_axis(forces))
    return _laid_out(figure, "Spectrum of the force", 480)


def response(one: Response) -> go.Figure:
    """Magnitude and phase with the band that holds 95 %."""
    return responses([("best linear approximation", one)])


def responses(named: Sequence[tuple[str, Response]]) -> go.Figure:
    """Magnitude and phase of several approximations over one quantity, each with the band that holds 95 %."""
    title, unit = _TITLES[named[0][1].over]
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06, row_heights=[0.62, 0.38])
    for number, (name, one) in enumerate(named):
        _add_response(figure, one, name, COLOURS[number % len(COLOURS)], number)
    figure.update_xaxes(**log_axis(_all(one.frequency_hz for _, one in named)))
    figure.update_xaxes(title="frequency, Hz", row=2, col=1)
    figure.update_yaxes(
        title=f"magnitude, {unit}", row=1, col=1, **log_axis(_all(np.abs(one.value) for _, one in named))
    )
    figure.update_yaxes(title="phase, °", row=2, col=1)
    return _laid_out(figure, title, 520)


def _add_response(figure: go.Figure, one: Response, name: str, colour: str, number: int) -> None:
    every = _every(one.frequency_hz)
    frequency, value, bound = one.frequency_hz[every], one.value[every], one.bound[every]
    size, phase = np.abs(value), np.degrees(np.angle(value))
    # 95 % of a normal part of a circular error, from the radius that holds 95 % of both parts
    half = bound * (1.96 / np.sqrt(2.0) / np.sqrt(-np.log(0.05)))
    turn = np.degrees(np.arcsin(np.minimum(half / np.maximum(size, np.finfo(np.float64).tiny), 1.0)))
    for row, middle, low, high in (
        (1, size, np.maximum(size - half, _LOWEST * size), size + half),
        (2, phase, phase - turn, phase + turn),
    ):
        _band(figure, frequency, low, high, row, colour, first=number == 0)
        figure.add_scatter(
            x=frequency, y=middle, mode="lines+markers", marker={"size": 4}, line={"color": colour, "width": 1.5},
            name=name, legendgroup=f"{number}", showlegend=row == 1, row=row, col=1,
        )  # fmt: skip


def _band(
    figure: go.Figure, frequency: Floats, low: Floats, high: Floats, row: int, colour: str, *, first: bool
) -> None:
    known = np.isfinite(low) & np.isfinite(high)
    if not np.any(known):
        return
    across = np.concatenate([frequency[known], frequency[known][::-1]])
    figure.add_scatter(
        x=across, y=np.concatenate([low[known], high[known][::-1]]), fill="toself", mode="lines", line={"width": 0},
        fillcolor=_clear(colour), name="holds it with 95 %", legendgroup="band", showlegend=first and row == 1,
        hoverinfo="skip", row=row, col=1,
    )  # fmt: skip


def _clear(colour: str) -> str:
    """A quarter of the colour, so that what lies behind shows."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.25)"


def over_levels(named: Sequence[tuple[str, Analysis]]) -> go.Figure:
    """Parts of the force at each level, as shares of its rms, with their bounds."""
    figure = go.Figure()
    names = [name for name, _ in named]
    numbers = [str(number) for number, _ in enumerate(named, start=1)]
    for kind, of in _PARTS.items():
        name, colour, symbol = _KINDS[kind]
        rows = [(of(found.levels), found.levels.force_rms) for _, found in named]
        if not any(level is not None for level, _ in rows):
            continue
        share = [None if level is None or not force else 100.0 * level.rms / force for level, force in rows]
        ends = [
            (0.0, 0.0) if level is None or not force else tuple(100.0 * end / force for end in level.bounds)
            for level, force in rows
        ]
        figure.add_scatter(
            x=numbers, y=share, mode="markers", name="noise of one period" if kind == "noise" else name, text=names,
            marker={"size": 9, "symbol": symbol, "color": colour},
            error_y={
                "type": "data", "symmetric": False, "thickness": 1,
                "array": [high - (value or 0.0) for (_, high), value in zip(ends, share, strict=True)],
                "arrayminus": [(value or 0.0) - low for (low, _), value in zip(ends, share, strict=True)],
            },
        )  # fmt: skip
    figure.update_xaxes(title="level, as in the table", type="category")
    figure.update_yaxes(title="% of the rms force", rangemode="tozero")
    return _laid_out(figure, "Distortion and noise from level to level", 440)


_PARTS: dict[str, Callable[[Levels], Level | None]] = {
    "odd": lambda levels: levels.odd,
    "even": lambda levels: levels.even,
    "odd and even": lambda levels: levels.nonlinear if levels.odd is None else None,
    "noise": lambda levels: levels.noise,
}


def coherence(found: Analysis) -> go.Figure:
    """Share of the force on each driven line that follows the motion linearly."""
    figure = go.Figure()
    every = _every(found.frequency_hz)
    for name, values, colour in (
        ("with distortion and noise", found.coherence, COLOURS[0]),
        ("with noise alone", found.noise_coherence, COLOURS[7]),
    ):
        if np.isfinite(values).any():
            figure.add_scatter(
                x=found.frequency_hz[every], y=values[every], mode="lines+markers", name=name, marker={"size": 4},
                line={"color": colour, "width": 1.5},
            )  # fmt: skip
    figure.update_xaxes(title="frequency, Hz", **log_axis(found.frequency_hz))
    figure.update_yaxes(title="coherence")
    return _laid_out(figure, "Coherence: linear share of the force", 360)


def over_time(found: Analysis) -> go.Figure:
    """The force of each period: its size beside the mean one, and its mean."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.12)
    for number, trend in enumerate(found.variation.trends):
        count, colour = np.arange(1, trend.gain.size + 1), COLOURS[number % len(COLOURS)]
        error = {"type": "constant", "value": 196.0 * trend.gain_std, "thickness": 1}
        for row, values in ((1, 100.0 * (trend.gain - 1.0)), (2, trend.mean)):
            figure.add_scatter(
                x=count, y=values, mode="lines+markers", name=trend.name, legendgroup=trend.name, showlegend=row == 1,
                error_y=error if row == 1 else None, line={"color": colour, "width": 1.5}, row=row, col=1,
            )  # fmt: skip
    most = max(trend.gain.size for trend in found.variation.trends)
    figure.update_xaxes(dtick=1 if most <= _EACH else None)
    figure.update_xaxes(title="period", row=2, col=1)
    figure.update_yaxes(title="change of the force, %", row=1, col=1)
    figure.update_yaxes(title="mean force, N", row=2, col=1)
    return _laid_out(figure, "From period to period", 540)


def log_axis(values: Floats) -> dict[str, Any]:
    """A logarithmic axis whose marks are written out: where plotly writes the first digit alone, 2 may be 20.

    Over a decade or more the marks are 1, 2 and 5, over many decades 1. Any: arguments of plotly.
    """
    known = values[np.isfinite(values) & (values > 0.0)]
    if known.size == 0 or (low := float(known.min())) * 10.0 > (high := float(known.max())):
        return {"type": "log"}
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    digits = (1, 2, 5) if last - first <= _DECADES else (1,)
    marks = [digit * 10.0**power for power in range(first, last + 1) for digit in digits]
    return {"type": "log", "tickvals": marks, "ticktext": [_number(mark) for mark in marks]}


def _number(value: float) -> str:
    """With a thin space after each three digits."""
    return f"{value:,.0f}".replace(",", "\u2009") if value >= 1.0 else f"{value:g}"


def _all(parts: Iterable[Floats]) -> Floats:
    return np.concatenate([np.zeros(0), *parts])


def _shown(values: Floats) -> list[float | None]:
    """Without zeros, which a logarithmic axis cannot show."""
    return [float(value) if value > 0.0 else None for value in values]


def _every(values: Floats) -> slice:
    return slice(None, None, max(1, -(-values.size // _POINTS)))


def _laid_out(figure: go.Figure, title: str, height: int) -> go.Figure:
    legend = {"orientation": "h", "y": -0.2, "bgcolor": CLEAR}
    return figure.update_layout(title=title, height=height, showlegend=True, legend=legend, **LAYOUT)
