"""The page of a sensitivity study: the shares by each method side by side."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.page_style import COLOURS, LAYOUT, document, plots, table
from identification.studies.sensitivity.described import cautions, in_short
from identification.studies.sensitivity.result import GARSON, Sensitive

_METHODS = (
    "Output: rms change of the force over one settled period. Garson: mean of the networks, its bar from the lowest to "
    "the highest of them. Variance: Sobol's indices over the box between the lowest and highest level. One at a time: "
    "the greatest change with the other parameters as in the model. Local slope: rms of p·∂F/∂p. All in % of their sum."
)


def write_sensitivity(path: Path, found: Sensitive) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(document("Sensitivity", _parts(found)), encoding="utf-8")


def _parts(found: Sensitive) -> Iterator[str]:
    asked, shares = found.asked, found.shares()
    yield f"<h1>Sensitivity of the force: {html.escape(found.model)}</h1><p><b>{html.escape(in_short(found))}</b></p>"
    yield (
        f"<p>Sine of {1e3 * asked.amplitude_m:g} mm at {asked.frequency_hz:g} Hz, {asked.current_a:g} A; "
        f"{found.changes.size} samples: every combination of {', '.join(f'{v:g}' for v in asked.levels)} times the "
        f"value of each parameter. Network {len(found.names)}–{asked.hidden}–1; "
        f"{100.0 * min(n.within for n in found.networks):.1f} % of the unseen samples are within 5 %.</p>"
    )
    head = "<tr>" + "".join(f"<th>{name}</th>" for name in ("parameter", "value", *shares)) + "</tr>"
    order = np.argsort(-shares[GARSON])
    yield table(head, [_row(found, int(k)) for k in order])
    yield f"<p class=note>{_METHODS}</p><h2>What these shares do not say</h2>"
    yield "<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in cautions(found)) + "</ul>"
    yield from plots([bars(found)])


def _row(found: Sensitive, k: int) -> list[str]:
    shares = (f"{part[k]:.3g} %" for part in found.shares().values())
    return [html.escape(found.names[k]), f"{found.values[k]:.5g}", *shares]


def bars(found: Sensitive) -> go.Figure:
    """Share of every parameter by every method."""
    figure, shares = go.Figure(), found.shares()
    order = np.argsort(-shares[GARSON])
    names = [found.names[k] for k in order]
    for (method, part), colour in zip(shares.items(), COLOURS, strict=False):
        bar = None
        if method == GARSON:
            spread = 100.0 * found.garson[:, order]
            up, down = spread.max(axis=0) - part[order], part[order] - spread.min(axis=0)
            bar = {"type": "data", "symmetric": False, "array": up, "arrayminus": down}
        figure.add_bar(x=names, y=part[order], name=method, marker={"color": colour}, error_y=bar)
    figure.update_yaxes(title="share, %")
    return figure.update_layout(height=460, barmode="group", title="Share of each parameter", **LAYOUT)
