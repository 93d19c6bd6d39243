"""The page of a search for regressors: the error along its path, all that was tried, and each signal left out."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from pathlib import Path

import plotly.graph_objects as go

from excitation.atomic import written_whole
from identification.blackbox.search import Search
from identification.blackbox.selection import Step, Tried
from identification.blackbox.structure import SYMBOLS, Structure
from identification.errors import OutputError

_TAKEN, _OTHERS, _WITHOUT = "#00798c", "#b9c4c9", "#d1495b"
_LAYOUT = {"template": "plotly_white", "font": {"family": "system-ui, sans-serif", "size": 13}}
_FARTHEST = 4.0  # times the error of a step's start: a structure that failed is not drawn beyond
_STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1b1b1b}
h1{font-size:1.5em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:1.8em}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
td,th{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:right}th{background:#f6f6f6}
td.word,th.word{text-align:left}p.note{color:#555}"""


def write_search_page(path: Path, name: str, found: Search) -> None:
    """Write the page, whole or not at all; it opens offline. Raises OutputError where it can't be written."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(search_html(name, found), encoding="utf-8")


def search_html(name: str, found: Search) -> str:
    """The page as text."""
    best = found.found
    figures = [path_drawn(found), without_drawn(found)]
    plots = [
        one.to_html(full_html=False, include_plotlyjs=k == 0, div_id=f"figure-{k}") for k, one in enumerate(figures)
    ]
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Regressors of {escape(name)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>Regressors of {escape(name)}</h1>"
        f"<p><b>{_names(best.structure)}</b>: {best.rrmsse:.2f} % error in free run on the training, "
        f"{found.trained} structures trained.</p>"
        f"<h2>Path of the search</h2>{plots[0]}{_path_table(found.path)}"
        f"<h2>The same without one signal</h2>{plots[1]}{_without_table(found)}"
        "<p class=note>Error: root mean square of measured minus simulated force, % of the root mean square of the "
        "force about its mean. The simulation sees no measured force. A name such as v1 is a signal (F force, x "
        "displacement, v velocity, a acceleration, i current, T temperature) and how many samples old it is.</p>"
        "</body></html>\n"
    )


def path_drawn(found: Search) -> go.Figure:
    """The error after each step, and of what was tried beside it."""
    steps = found.path
    acts = [f"{k}: {step.act}" for k, step in enumerate(steps)]
    figure = go.Figure()
    x, y, text = [], [], []
    for k, (before, step) in enumerate(pairwise(steps), start=1):
        for one in tried_beside(found, before.tried, grows=step.act.startswith("+")):
            if one.rrmsse <= _FARTHEST * before.tried.rrmsse:
                x.append(acts[k])
                y.append(one.rrmsse)
                text.append(_names(one.structure))
    figure.add_scatter(
        x=acts, y=[step.tried.rrmsse for step in steps], mode="lines+markers", name="taken",
        text=[_names(step.tried.structure) for step in steps], marker={"size": 10},
        line={"color": _TAKEN, "width": 2}, hovertemplate="%{text}<br>%{y:.2f} %",
    )  # fmt: skip
    figure.add_scatter(
        x=x, y=y, text=text, mode="markers", name="tried", marker={"color": _OTHERS, "size": 7},
        hovertemplate="%{text}<br>%{y:.2f} %",
    )  # fmt: skip
    figure.update_xaxes(title="step", categoryorder="array", categoryarray=acts)
    figure.update_yaxes(title="error in free run, %", type="log")
    return figure.update_layout(height=430, margin={"t": 30, "r": 20}, **_LAYOUT)


def tried_beside(found: Search, before: Tried, *, grows: bool) -> list[Tried]:
    """Every structure that was tried and has one regressor more, or one less, than `before`."""
    old = set(before.structure.regressors)
    out = []
    for one in found.known.values():
        new = set(one.structure.regressors)
        nearer, farther = (old, new) if grows else (new, old)
        if one.structure.nodes == before.structure.nodes and nearer < farther and len(farther - nearer) == 1:
            out.append(one)
    return out


def without_drawn(found: Search) -> go.Figure:
    """The error with all regressors, and without those of each signal."""
    names = ["all", *(f"without {SYMBOLS[one]}" for one in found.without)]
    errors = [found.found.rrmsse, *(one.rrmsse for one in found.without.values())]
    colours = [_TAKEN, *[_WITHOUT] * len(found.without)]
    figure = go.Figure(
        go.Bar(x=names, y=errors, marker={"color": colours}, text=[f"{one:.2f} %" for one in errors], width=0.5)
    )
    figure.update_traces(textposition="outside", cliponaxis=False)
    figure.update_yaxes(title="error in free run, %")
    return figure.update_layout(height=340, margin={"t": 40, "r": 20}, **_LAYOUT)


def _path_table(steps: Sequence[Step]) -> str:
    rows = "".join(
        f"<tr><td class=word>{escape(step.act)}</td><td class=word>{_names(step.tried.structure)}</td>"
        f"<td>{step.tried.rrmsse:.2f}</td><td>{step.count}</td></tr>"
        for step in steps
    )
    head = "<th class=word>step</th><th class=word>regressors</th><th>error, %</th><th>tried</th>"
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _without_table(found: Search) -> str:
    rows = "".join(
        f"<tr><td class=word>without {SYMBOLS[symbol]}</td><td class=word>{_names(one.structure)}</td>"
        f"<td>{one.rrmsse:.2f}</td><td>{one.rrmsse / found.found.rrmsse:.2g}</td></tr>"
        for symbol, one in found.without.items()
    )
    head = "<th class=word></th><th class=word>regressors</th><th>error, %</th><th>times that of all</th>"
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _names(structure: Structure) -> str:
    return " ".join(map(str, structure.regressors))
