"""The page of a complexity study: the indicator of every step, the simplification, the ladder."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path

import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.page_style import COLOURS, LAYOUT, document, plots, table
from identification.studies.complexity.described import advice, in_short
from identification.studies.complexity.result import Complexity, Rung

_ON_INDICATOR = (
    "Uncertain: change of the step's output when the parameter in brackets moves by one standard deviation of what the "
    "tests leave uncertain. Without it: change when the element is left out and the rest is fitted again. Measure "
    "more: the first is larger than what matters; simplify: the second is smaller; keep: neither."
)
_ON_LADDER = (
    "Every rung is fitted to the same tests; each lacks the element of the next that costs least to leave out. Error: "
    "rms of measured minus simulated force over that of the measured about its mean. Cost: time for one simulated "
    "second on the machine that made this page. Knee: farthest below the line from the first to the last rung, "
    "logarithm of the error over free parameters."
)


def write_complexity(path: Path, found: Complexity) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(document("Complexity", _parts(found)), encoding="utf-8")


def _parts(found: Complexity) -> Iterator[str]:
    name = html.escape(found.model.name)
    yield f"<h1>How complex must it be: {name}</h1><p><b>{html.escape(in_short(found))}</b></p>"
    yield f"<p>Uncertainty from {found.spread}. A change of {100.0 * found.matters:g} % of an output matters.</p>"
    yield "<h2>What each element is worth at each step</h2>"
    rows = [
        [
            html.escape(one.step), html.escape(one.element),
            f"{100.0 * one.uncertain:.3g} %" + (f" ({one.parameter})" if one.parameter else ""),
            "–" if one.without is None else f"{100.0 * one.without:.3g} %",
            f"<div style='white-space:normal;min-width:15em'>{html.escape(advice(one))}</div>",
        ]
        for one in found.indicators
    ]  # fmt: skip
    yield table(_head("step", "element", "uncertain", "without it", "verdict"), rows)
    yield f"<p class=note>{_ON_INDICATOR}</p><h2>The ladder</h2>"
    head = _head(
        "model", "kind", "free parameters", "error", "cost of a simulated second", *map(html.escape, found.steps)
    )
    rungs = (*found.ladder, *found.beside)
    yield table(head, [_row(number, rung, found) for number, rung in enumerate(rungs, start=1)])
    yield f"<p class=note>{_ON_LADDER}</p>"
    failed = [f"{r.label}: {r.why}" for r in (*found.ladder, *found.beside) if r.why]
    yield "<ul>" + "".join(f"<li>{html.escape(one)}</li>" for one in failed) + "</ul>"
    yield from plots([worth(found), ladder(found)])


def _head(*names: str) -> str:
    return "<tr>" + "".join(f"<th>{name}</th>" for name in names) + "</tr>"


def _row(number: int, rung: Rung, found: Complexity) -> list[str]:
    mark = " (knee)" if found.knee is not None and rung.label == found.knee.label else ""
    return [
        f"{number} · {html.escape(rung.label)}{mark}", rung.kind, "not stated" if rung.free is None else str(rung.free),
        "fails" if rung.rrmsse is None else f"{rung.rrmsse:.3g} %",
        "–" if rung.cost is None else f"{1e6 * rung.cost:.3g} µs",
        *("–" if one is None else f"{one:.4g}" for one in rung.outputs),
    ]  # fmt: skip


def worth(found: Complexity) -> go.Figure:
    """The indicator: what is uncertain, for every element and step."""
    figure = go.Figure()
    for step, colour in zip(found.steps, COLOURS * len(found.steps), strict=False):
        own = [one for one in found.indicators if one.step == step]
        figure.add_bar(
            x=[one.element for one in own], y=[100.0 * one.uncertain for one in own], name=step,
            marker={"color": colour},
        )  # fmt: skip
    figure.add_hline(y=100.0 * found.matters, line={"dash": "dash", "color": "#808890"}, annotation_text="matters")
    figure.update_yaxes(title="change of the output, %")
    return figure.update_layout(height=400, title="What the tests leave uncertain in the vehicle", **LAYOUT)


def ladder(found: Complexity) -> go.Figure:
    """Error over cost, the rungs joined, other models beside them; numbered as in the table."""
    figure = go.Figure()
    first = 1
    for rungs, name, mode in ((found.ladder, "ladder", "lines+markers+text"), (found.beside, "beside", "markers+text")):
        ran = [(n, r) for n, r in enumerate(rungs, start=first) if r.rrmsse is not None and r.cost is not None]
        first += len(rungs)
        if ran:
            figure.add_scatter(
                x=[1e6 * (r.cost or 0.0) for _, r in ran], y=[r.rrmsse for _, r in ran], text=[str(n) for n, _ in ran],
                hovertext=[r.label for _, r in ran], name=name, mode=mode, textposition="top center",
                line={"color": COLOURS[0]} if name == "ladder" else None, marker={"size": 9},
            )  # fmt: skip
    figure.update_xaxes(title="cost of a simulated second, µs", type="log")
    figure.update_yaxes(title="error, %", type="log")
    return figure.update_layout(height=480, title="Error over cost", **LAYOUT)
