"""The pictures of the sheet: each a plotly figure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from identification.force_velocity import SidedCurve, at_peak_speed
from identification.page_style import CLEAR, COLOURS, LAYOUT
from identification.sheet.results import AtCurrent, Sheet, SineTest
from identification.steady import Cycles, dynamic_stiffness, loss_factor

Floats = NDArray[np.float64]

_DECADES = 20.0  # a wider range has a logarithmic axis
_POINTS = 240  # of a loop
_SAMPLES = 1500  # of a cloud of samples


def charts(sheet: Sheet) -> list[go.Figure]:
    """All figures, in the order of the page."""
    found = [peak_velocity(sheet.currents), continuous_velocity(sheet.currents), loops(sheet.tests)]
    if sheet.temperatures:
        found.append(temperature(sheet))
    return [*found, *over_frequency(sheet.tests)]


def peak_velocity(currents: Sequence[AtCurrent]) -> go.Figure:
    """PVP: force of each test at its peak speeds, rebound above, compression below, with the curve of each side."""
    figure = go.Figure()
    for number, group in enumerate(currents):
        colour, label = COLOURS[number % len(COLOURS)], _current(group, "tests")
        _points(figure, at_peak_speed([t.cycles for t in group.tests]), colour, label, ("triangle-up", "triangle-down"))
        if group.curve is not None:
            _sides(figure, group.curve, max(t.cycles.peak_velocity_m_s for t in group.tests), colour)
        simulated = [test.simulated for test in group.tests if test.simulated is not None]
        if simulated:
            _points(figure, at_peak_speed(simulated), colour, f"{label}, model", ("x-thin", "x-thin"))
    figure.update_xaxes(title="peak speed, m/s", rangemode="tozero")
    figure.update_yaxes(title="force at peak speed, N")
    return _laid_out(figure, "Peak-velocity plot (PVP): rebound ▲, compression ▼", 460)


def _points(
    figure: go.Figure, points: tuple[Floats, Floats], colour: str, label: str, symbols: tuple[str, str]
) -> None:
    speeds, forces = points
    for first, symbol in zip((0, 1), symbols, strict=True):  # rebound and compression alternate
        marker = {"size": 9, "color": colour, "symbol": symbol, "line": {"color": colour, "width": 2}}
        figure.add_scatter(
            x=np.abs(speeds[first::2]), y=forces[first::2], mode="markers", name=label, legendgroup=label,
            showlegend=first == 0, marker=marker,
        )  # fmt: skip


def _sides(figure: go.Figure, curve: SidedCurve, reach: float, colour: str) -> None:
    v = np.linspace(1e-6, 1.05 * reach, 200)
    for side in (v, -v):
        figure.add_scatter(
            x=v, y=curve(side), mode="lines", name="curve of the side", showlegend=False, hoverinfo="skip",
            line={"color": colour, "width": 1.5},
        )  # fmt: skip


def continuous_velocity(currents: Sequence[AtCurrent]) -> go.Figure:
    """CVP: force over velocity through the whole cycle of the fastest test at each current."""
    figure = go.Figure()
    for number, group in enumerate(currents):
        fastest = group.tests[-1]
        colour = COLOURS[number % len(COLOURS)]
        every = -(-fastest.cycles.v.size // _SAMPLES)
        figure.add_scatter(
            x=fastest.cycles.v[::every], y=fastest.cycles.force[::every], mode="markers", name="samples",
            showlegend=number == 0, hoverinfo="skip", marker={"size": 2.5, "color": "#9aa4ad"},
        )  # fmt: skip
        _, v, force = _loop(fastest.cycles)
        figure.add_scatter(x=v, y=force, mode="lines", name=fastest.label, line={"color": colour, "width": 2})
    figure.update_xaxes(title="velocity, m/s")
    figure.update_yaxes(title="force, N")
    return _laid_out(figure, "Continuous-velocity plot (CVP): the fastest test", 460)


def loops(tests: Sequence[SineTest]) -> go.Figure:
    """Force over displacement and over velocity, one closed loop for each test; those of a model are dashed."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=("force over displacement", "force over velocity"))
    for number, test in enumerate(tests):
        for cycles, dash in ((test.cycles, "solid"), (test.simulated, "dash")):
            if cycles is None:
                continue
            x, v, force = _loop(cycles)
            line = {"color": COLOURS[number % len(COLOURS)], "width": 1.5, "dash": dash}
            for column, axis in ((1, 1e3 * x), (2, v)):
                figure.add_scatter(
                    x=axis, y=force, mode="lines", name=test.label, legendgroup=cycles.name,
                    showlegend=column == 1 and dash == "solid", line=line, row=1, col=column,
                )  # fmt: skip
    figure.update_xaxes(title="displacement, mm", row=1, col=1)
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_yaxes(title="force, N", row=1, col=1)
    return _laid_out(figure, "Loops", 500 + 8 * len(tests))


def temperature(sheet: Sheet) -> go.Figure:
    """The temperature through all runs."""
    figure = go.Figure()
    for one in sheet.temperatures:
        figure.add_scatter(
            x=one.at, y=one.degc, mode="lines", name=one.run, showlegend=False, line={"color": COLOURS[1], "width": 2}
        )
    figure.update_xaxes(
        title="time since the first run, min" if sheet.by_time else "number of the run",
        dtick=None if sheet.by_time else 1,
    )
    figure.update_yaxes(title="temperature, °C")
    return _laid_out(figure, "Temperature over the runs", 320)


def over_frequency(tests: Sequence[SineTest]) -> list[go.Figure]:
    """Dynamic stiffness and loss factor over frequency, a line for each amplitude and current."""
    stiffness = [dynamic_stiffness(test.cycles) / 1e3 for test in tests]
    losses = [loss_factor(test.cycles) for test in tests]
    return [
        _over_frequency(tests, stiffness, "Dynamic stiffness |F/X|", "kN/m"),
        _over_frequency(tests, [abs(loss) for loss in losses], "Loss factor |tan φ|", "–"),
    ]


def _over_frequency(tests: Sequence[SineTest], values: Sequence[float], title: str, unit: str) -> go.Figure:
    lines: dict[str, list[tuple[float, float]]] = {}
    for test, value in zip(tests, values, strict=True):
        current = "" if test.current_asked is None else f", {test.current_asked:g} A"
        lines.setdefault(f"{1e3 * test.amplitude_asked:g} mm{current}", []).append((test.frequency_asked, value))
    figure = go.Figure()
    for number, (name, points) in enumerate(sorted(lines.items(), key=lambda line: float(line[0].split()[0]))):
        ordered = sorted(points)
        figure.add_scatter(
            x=[f for f, _ in ordered], y=[one for _, one in ordered], mode="lines+markers", name=name,
            line={"color": COLOURS[number % len(COLOURS)], "width": 1.5}, marker={"size": 8},
        )  # fmt: skip
    figure.update_xaxes(title="frequency, Hz", **_scale([test.frequency_asked for test in tests]))
    figure.update_yaxes(title=f"{title.split(' |')[0].lower()}, {unit}", **_scale(values))
    return _laid_out(figure, title, 400)


def _scale(values: Sequence[float]) -> dict[str, str]:
    """Logarithmic where the values span decades."""
    wide = 0.0 < min(values) < max(values) / _DECADES
    return {"type": "log", "dtick": "D2"} if wide else {"type": "linear", "rangemode": "tozero"}


def _laid_out(figure: go.Figure, title: str, height: int) -> go.Figure:
    legend = {"orientation": "h", "y": -0.2, "bgcolor": CLEAR}
    return figure.update_layout(title=title, height=height, showlegend=True, legend=legend, **LAYOUT)


def _loop(cycles: Cycles) -> tuple[Floats, Floats, Floats]:
    """A closed loop."""
    x, v, force = (np.append(s, s[0]) for s in cycles.loop(_POINTS))
    return x, v, force


def _current(group: AtCurrent, without: str) -> str:
    return without if group.current is None else f"{group.current:g} A"
