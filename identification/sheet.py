"""The characteristic sheet of a damper: loops, peak- and continuous-velocity plots, maps; one HTML page."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import QhullError

from excitation.atomic import written_whole
from identification.datachecks import findings_in
from identification.errors import DataError, OutputError
from identification.force_velocity import ArctanCurve, arctan_fit, at_peak_speed, hysteresis_width
from identification.models.protocol import SimulationModel
from identification.models.simulation import SIMULATED, with_simulation
from identification.steady import (
    Cycles,
    dynamic_stiffness,
    energy_per_cycle,
    loop_shape,
    loss_factor,
    steady_cycles,
)
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_SIGNS = Path(__file__).with_name("signs.svg")  # the convention, as the README shows it
_LAYOUT = {"template": "plotly_white", "font": {"family": "system-ui, sans-serif", "size": 13}}
_COLOURS = ("#00798c", "#d1495b", "#e0a800", "#30638e", "#6a994e", "#7b2d8b", "#b56576", "#4d4d4d")
_STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1b1b1b}
table{border-collapse:collapse;width:100%}td,th{padding:.25em .6em;border-bottom:1px solid #ddd;text-align:right}
td:first-child,th:first-child{text-align:left}p.note{color:#555}"""


def write_sheet(
    path: Path, runs: Sequence[Run], model: SimulationModel | None = None
) -> list[dict[str, float | str | None]]:
    """Write the page, whole or not at all; returns the rows of its table.

    With a `model` its loops and peak velocities are drawn with the measured ones, dashed.

    Raises
    ------
    DataError
        when no run is a steady sine, or one lacks what the model needs.
    SimulationError
        when the model fails on a run.
    """
    found = [(run, steady_cycles(run)) for run in runs]
    tests = sorted((c for _, c in found if c is not None), key=_order)
    left_out = [_name(run) for run, cycles in found if cycles is None]
    if not tests:
        raise DataError(
            f"{', '.join(left_out) or 'no run'}: no steady sine: the sheet needs whole cycles of a sine "
            "and a force that varies"
        )
    simulated = [] if model is None else _simulated(model, [run for run, cycles in found if cycles is not None])
    speeds, forces = at_peak_speed(tests)
    one_current = np.ptp([test.current or 0.0 for test in tests]) < 0.02
    curve = arctan_fit(speeds, forces) if speeds.size >= 8 and one_current else None
    figures = [
        loops(tests, simulated),
        peak_velocity(tests, curve, simulated),
        continuous_velocity(tests),
        *maps(tests),
    ]
    seen = findings_in(runs)
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(_page(tests, figures, curve, left_out, seen), encoding="utf-8")
    beside = {test.name: test for test in simulated}
    return [row(test) | _simulated_row(beside.get(test.name), model) for test in tests]


def _simulated(model: SimulationModel, runs: Sequence[Run]) -> list[Cycles]:
    """The tests as the model simulates them; without those where its force is constant."""
    found = [steady_cycles(run, SIMULATED) for run in with_simulation(model, runs)]
    return [cycles for cycles in found if cycles is not None]


def _simulated_row(test: Cycles | None, model: SimulationModel | None) -> dict[str, float | str | None]:
    """The simulation of a test; nothing without a model."""
    if model is None:
        return {}
    force = None if test is None else test.loop()[2]
    return {
        "force_max_simulated": None if force is None else float(force.max()),
        "force_min_simulated": None if force is None else float(force.min()),
        "energy_per_cycle_simulated": None if test is None else energy_per_cycle(test),
    }


def row(test: Cycles) -> dict[str, float | str | None]:
    """The figures of one test, SI; ``force_rebound`` and ``force_compression`` are those at the peak speeds."""
    rebound, compression = map(float, at_peak_speed([test])[1])
    return {
        "run": test.name,
        "frequency": test.frequency_hz,
        "amplitude": test.amplitude_m,
        "peak_velocity": test.peak_velocity_m_s,
        "current": test.current,
        "force_max": float(test.loop()[2].max()),
        "force_min": float(test.loop()[2].min()),
        "force_rebound": rebound,
        "force_compression": compression,
        "hysteresis_width": hysteresis_width(test),
        "dynamic_stiffness": dynamic_stiffness(test),
        "loss_factor": loss_factor(test),
        "energy_per_cycle": energy_per_cycle(test),
        "loop_shape": loop_shape(test),
    }


def loops(tests: Sequence[Cycles], simulated: Sequence[Cycles] = ()) -> go.Figure:
    """Force over displacement and over velocity, one closed loop for each test; those of a model are dashed."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=("force over displacement", "force over velocity"))
    number = {test.name: k for k, test in enumerate(tests)}
    for test, dash in [*((t, "solid") for t in tests), *((t, "dash") for t in simulated)]:
        x, v, force = (np.append(s, s[0]) for s in test.loop())
        line = {"color": _COLOURS[number[test.name] % len(_COLOURS)], "width": 1.5, "dash": dash}
        for column, axis in ((1, 1e3 * x), (2, v)):
            figure.add_scattergl(
                x=axis, y=force, mode="lines", name=_label(test), legendgroup=test.name,
                showlegend=column == 1 and dash == "solid", line=line, row=1, col=column,
            )  # fmt: skip
    figure.update_xaxes(title="displacement, mm", row=1, col=1)
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_yaxes(title="force, N", row=1, col=1)
    return figure.update_layout(title="Loops", height=520, **_LAYOUT)


def peak_velocity(tests: Sequence[Cycles], curve: ArctanCurve | None, simulated: Sequence[Cycles] = ()) -> go.Figure:
    """PVP: force of each test at its peak speeds in rebound and compression, a line for each current."""
    figure = go.Figure()
    for number, (current, group) in enumerate(_by_current(tests)):
        speeds, forces = at_peak_speed(group)
        order = np.argsort(speeds)
        figure.add_scatter(
            x=speeds[order], y=forces[order], mode="markers+lines" if curve is None else "markers",
            name="tests" if current is None else f"{current:.2g} A",
            line={"color": _COLOURS[number % len(_COLOURS)]}, marker={"size": 8},
        )  # fmt: skip
    if curve is not None:
        reach = max(test.peak_velocity_m_s for test in tests) * 1.1
        v = np.linspace(-reach, reach, 400)
        name = f"(2/π)·arctan({curve.S:.3g} v)·{curve.F1:.4g} + {curve.d:.3g} v + {curve.F2:.3g}"
        figure.add_scatter(x=v, y=curve(v), mode="lines", name=name, line={"color": "#4d4d4d", "dash": "dot"})
    for number, (_, group) in enumerate(_by_current(sorted(simulated, key=_order))):
        speeds, forces = at_peak_speed(group)
        order = np.argsort(speeds)
        line = {"color": _COLOURS[number % len(_COLOURS)], "dash": "dash"}
        figure.add_scatter(
            x=speeds[order], y=forces[order], mode="markers+lines", name="model", showlegend=number == 0, line=line,
            marker={"symbol": "x", "size": 7},
        )  # fmt: skip
    figure.update_xaxes(title="peak velocity, m/s")
    figure.update_yaxes(title="force at peak speed, N")
    legend = {"orientation": "h", "y": -0.2}
    return figure.update_layout(title="Peak-velocity plot (PVP)", height=440, legend=legend, **_LAYOUT)


def continuous_velocity(tests: Sequence[Cycles]) -> go.Figure:
    """CVP: force over velocity through the whole cycle of the fastest test at each current."""
    figure = go.Figure()
    for number, (current, group) in enumerate(_by_current(tests)):
        fastest = max(group, key=lambda c: c.peak_velocity_m_s)
        _, v, force = (np.append(s, s[0]) for s in fastest.loop())
        figure.add_scattergl(
            x=fastest.v, y=fastest.force, mode="markers", name="samples", showlegend=number == 0,
            marker={"size": 2, "color": "#c8c8c8"},
        )  # fmt: skip
        line = {"color": _COLOURS[number % len(_COLOURS)], "width": 2}
        name = _label(fastest) if current is None else f"{current:.2g} A, {_label(fastest)}"
        figure.add_scattergl(x=v, y=force, mode="lines", name=name, line=line)
    figure.update_xaxes(title="velocity, m/s")
    figure.update_yaxes(title="force, N")
    return figure.update_layout(title="Continuous-velocity plot (CVP), fastest test", height=440, **_LAYOUT)


def maps(tests: Sequence[Cycles]) -> list[go.Figure]:
    """Dynamic stiffness and loss factor over frequency and amplitude."""
    return [
        _map(tests, np.array([dynamic_stiffness(t) for t in tests]) / 1e3, "Dynamic stiffness |F/X|", "kN/m"),
        _map(tests, np.array([loss_factor(t) for t in tests]), "Loss factor tan φ", "–"),
    ]


def _map(tests: Sequence[Cycles], values: Floats, title: str, unit: str) -> go.Figure:
    f, a = (
        np.array([float(f"{value:.3g}") for value in values])
        for values in ([t.frequency_hz for t in tests], [1e3 * t.amplitude_m for t in tests])
    )
    figure = go.Figure()
    surface = _surface(np.log10(f), np.log10(a), values)
    low, high = float(values.min()), float(values.max())
    scale = {"colorscale": "Viridis", "zmin": low, "zmax": high}
    if surface is not None:
        x, y, z = surface
        figure.add_heatmap(x=10**x, y=10**y, z=z, zsmooth="best", colorbar={"title": unit}, **scale)
    colour = {"color": values, "colorscale": "Viridis", "cmin": low, "cmax": high, "size": 13}
    colour |= {"line": {"color": "white", "width": 1}, "showscale": surface is None, "colorbar": {"title": unit}}
    figure.add_scatter(
        x=f, y=a, mode="markers+text", marker=colour, text=[f"{v:.3g}" for v in values], textposition="top center",
        hovertext=[t.name for t in tests], name="tests", showlegend=False,
    )  # fmt: skip
    figure.update_xaxes(title="frequency, Hz", type="log")
    figure.update_yaxes(title="amplitude, mm", type="log")
    return figure.update_layout(title=f"{title}, {unit}", height=440, **_LAYOUT)


def _surface(x: Floats, y: Floats, values: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Values between the tests, linear on logarithmic axes; None where they lie on a line."""
    points = np.stack([x, y], axis=1)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) < 6 or spread[-1] < 0.1 * spread[0]:
        return None
    try:
        between = LinearNDInterpolator(points, values, rescale=True)
    except QhullError:
        return None
    across, up = np.linspace(x.min(), x.max(), 60), np.linspace(y.min(), y.max(), 60)
    return across, up, np.asarray(between(*np.meshgrid(across, up)))


def _order(test: Cycles) -> tuple[float, float]:
    """By current, then by speed."""
    return test.current or 0.0, test.peak_velocity_m_s


def _by_current(tests: Sequence[Cycles]) -> list[tuple[float | None, list[Cycles]]]:
    """Tests in groups of one current, within 20 mA."""
    groups: list[tuple[float | None, list[Cycles]]] = []
    for test in tests:
        if groups and abs((groups[-1][0] or 0.0) - (test.current or 0.0)) < 0.02:
            groups[-1][1].append(test)
        else:
            groups.append((test.current, [test]))
    return groups


def _label(test: Cycles) -> str:
    current = "" if test.current is None else f", {test.current:.2g} A"
    return f"{1e3 * test.amplitude_m:.3g} mm, {test.frequency_hz:.3g} Hz{current}"


def _name(run: Run) -> str:
    return run.path.name if run.path is not None else run.run_id


_HEAD = (
    "run",
    "frequency, Hz",
    "amplitude, mm",
    "peak velocity, m/s",
    "current, A",
    "rebound at peak speed, N",
    "compression at peak speed, N",
    "hysteresis width, N",
    "stiffness, kN/m",
    "loss factor",
    "energy per cycle, J",
    "loop shape",
)


def _loss(test: Cycles) -> str:
    """The loss factor; beyond 100 the stored part is noise, and so is its sign."""
    value = loss_factor(test)
    return f"{value:.3g}" if abs(value) <= 100.0 else "above 100"


def _cells(test: Cycles) -> Iterable[str]:
    rebound, compression = at_peak_speed([test])[1]
    current = "" if test.current is None else f"{test.current:.3g}"
    return (
        html.escape(test.name), f"{test.frequency_hz:.4g}", f"{1e3 * test.amplitude_m:.4g}",
        f"{test.peak_velocity_m_s:.4g}", current, f"{rebound:.4g}", f"{compression:.4g}",
        f"{hysteresis_width(test):.3g}",
        f"{dynamic_stiffness(test) / 1e3:.4g}", _loss(test), f"{energy_per_cycle(test):.4g}",
        f"{loop_shape(test):.3f}",
    )  # fmt: skip


def _page(
    tests: Sequence[Cycles],
    figures: Sequence[go.Figure],
    curve: ArctanCurve | None,
    left_out: list[str],
    seen: list[str],
) -> str:
    head = "".join(f"<th>{h}</th>" for h in _HEAD)
    rows = "".join(f"<tr>{''.join(f'<td>{c}</td>' for c in _cells(test))}</tr>" for test in tests)
    plots = "".join(f.to_html(full_html=False, include_plotlyjs=k == 0) for k, f in enumerate(figures))
    fitted = "" if curve is None else (
        "<p>Force–velocity curve through the forces at peak speed, "
        f"(2/π)·arctan(S·v)·F1 + d·v + F2: S = {curve.S:.4g} ± "
        f"{curve.std[0]:.2g} s/m, F1 = {curve.F1:.5g} ± {curve.std[1]:.2g} N, d = {curve.d:.4g} ± {curve.std[2]:.2g} "
        f"N·s/m, F2 = {curve.F2:.4g} ± {curve.std[3]:.2g} N; residual {curve.rms:.3g} N rms.</p>"
    )  # fmt: skip
    skipped = (
        f"<p class=note>Left out, no steady sine or no force: {html.escape(', '.join(left_out))}.</p>"
        if left_out
        else ""
    )
    notes = "".join(f"<li>{html.escape(text)}</li>" for text in seen)
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Damper characteristics</title>'
        f"<style>{_STYLE}</style></head><body><h1>Damper characteristics</h1>"
        f"{_SIGNS.read_text(encoding='utf-8')}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{skipped}<ul>{notes}</ul>{fitted}{plots}"
        "<p class=note>Loops are drawn from up to 25 harmonics of the steady cycles. Loop shape: 1 is an ellipse, 1.27 "
        "a rectangle (dry friction), below 1 a peaked loop.</p></body></html>\n"
    )
