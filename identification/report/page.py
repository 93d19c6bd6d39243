"""The report for people: one page that opens offline."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import count
from typing import Any

import numpy as np
import plotly.graph_objects as go
import plotly.io as pio

from identification.criteria import TEXT
from identification.report import charts
from identification.report.page_data import PageData
from identification.report.report_file import NamedEffect, Report
from identification.report.sheet_part import sheet_chart, sheet_text
from identification.report.values import values_in_words

_VERDICTS = {
    "no_discrepancy": (
        "No discrepancy",
        "With its parameters fitted, the simulation meets the data down to the noise.",
    ),
    "explained": (
        "Explained",
        "The named effects bring the gap down to the noise, on runs that no fit has seen.",
    ),
    "partly_explained": ("Partly explained", "The named effects shrink the gap; something repeatable stays."),
    "unknown_effect": ("Unknown effect", "There is a repeatable gap that no element of the catalogue explains."),
}

_BUT_FOR_FORM = {
    "no_discrepancy": "With its parameters fitted, the simulation meets the data, but for what the canonical forms of "
    "effects that an earlier search has named may miss of real ones, or the steps of the solver leave.",
    "explained": "The named effects close the gap, but for what their canonical forms may miss of real ones, or the "
    "steps of the solver leave.",
}

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1b1b1b;max-width:1080px;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.6rem;margin:0}
h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid #ddd;padding-bottom:.2rem}
.verdict{border-left:8px solid #00798c;background:#f2f7f8;padding:1rem 1.2rem;margin:1rem 0}
.verdict.unknown_effect{border-color:#d1495b;background:#fbf3f4}.verdict.partly_explained{border-color:#e0a800;background:#fdf9ec}
.verdict b{font-size:1.25rem}.effect{margin:.4rem 0}table{border-collapse:collapse;width:100%;font-size:14px}
td,th{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #e5e5e5;vertical-align:top}th{background:#f6f6f6}
td.n{font-variant-numeric:tabular-nums;text-align:right}p.note,li{color:#444}code{background:#f3f3f3;padding:0 .25rem}
.wide{overflow-x:auto}
@media print{body{max-width:none;margin:0}h2{break-after:avoid}.plot,table{break-inside:avoid}}
"""


def page(report: Report, data: PageData) -> str:
    """The whole page, from what its two files hold and nothing else."""
    title = f"{data.name or 'Simulation'}: what it is missing"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">'
        f"<title>{html.escape(title)}</title>"
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head><body>'
        f"{''.join(_parts(report, data))}</body></html>\n"
    )


def _parts(report: Report, data: PageData) -> Iterator[str]:
    numbers = count(1)
    last = "with the named effects" if report.effects else "final"
    yield f"<h1>{html.escape(data.name or 'Simulation')}</h1>"
    yield _banner(report, data)
    yield _plots([charts.ladder(report.gap, data.train, data.held_out, last)], numbers)
    if report.distortion is not None:
        yield f"<p>{html.escape(_sentence(report.distortion.text))}</p>"
    if report.effects:
        yield _section("Named effects", _effects_table(report, data) + _aliases(data))
    if data.gap_map is not None:
        where = [charts.map_of_gap(data.gap_map), charts.profiles(data.profiles, report.where)]
        texts = _list(r.text for r in report.where)
        yield _section("Where the simulation and the measurement disagree", texts + _plots(where, numbers))
    before_after = [*(charts.loops(loop) for loop in data.loops), charts.spectrum(data.spectrum)]
    yield _section("Measured against simulated, before and after", _plots(before_after, numbers))
    if evidence := _evidence(report, data):
        yield _section("Evidence, and what was ruled out", _plots(evidence, numbers) + _ruled_out(data))
    if report.remainder.text:
        yield _section("What stays", f"<p>{html.escape(report.remainder.text)}</p>")
    if report.next_test.text:
        yield _section("The next test", f"<p>{html.escape(report.next_test.text)}</p>{_design(report)}")
    if data.sheet is not None:
        chart = _plots([sheet_chart(data.sheet)], numbers)
        yield _section("The damper's characteristics", sheet_text(data.sheet) + chart)
    yield _section("How far the base moved", _base_table(data))
    yield _section("How each run was read", _list(note for note in report.notes if note not in data.aliases))
    if data.reproduce:
        yield _section("Make this report again", f"<p><code>{html.escape(data.reproduce)}</code></p>")


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _evidence(report: Report, data: PageData) -> list[go.Figure]:
    figures = [charts.shapes_of_names(data.shapes, data.words)] if data.shapes else []
    if data.rivals:
        figures.append(charts.rivals(data.rivals, [f.element for f in report.effects], data.words))
    if data.strengths is not None:
        figures.append(charts.strengths(data.strengths, report.runs.train, data.words))
    return figures


def _design(report: Report) -> str:
    """The test as a table, and how to play it."""
    lines = "\n".join(f"{key} = {json.dumps(value)}" for key, value in report.next_test.design.items())
    play = "damper-rig run next_test.toml --rig ADDRESS -o runs"
    over_http = "beside this report on the command line; over HTTP the same table is a test of a campaign"
    return f"<pre>{html.escape(lines)}</pre><p><code>{play}</code>, {over_http}</p>" if lines else ""


def _section(title: str, content: str) -> str:
    return f"<h2>{title}</h2>{content}"


def _list(texts: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in texts) + "</ul>"


def _plots(figures: Iterable[go.Figure], numbers: Iterator[int]) -> str:
    """The figures, numbered on; the first of a page brings the JavaScript that draws them all."""
    out = []
    for figure, number in zip(figures, numbers, strict=False):
        drawn = pio.to_html(
            _in_template(figure),
            full_html=False,
            include_plotlyjs=number == 1,
            div_id=f"figure-{number}",
            config={"displaylogo": False, "responsive": True},
            validate=False,
        )
        out.append(f'<div class="plot">{drawn}</div>')
    return "".join(out)


def _in_template(figure: go.Figure) -> dict[str, Any]:  # Any: plotly's parts of a figure
    """The figure as plotly's script takes it. In a figure itself plotly would check its own template, for 0.1 s."""
    whole: dict[str, Any] = figure.to_dict()
    return whole | {"layout": whole["layout"] | {"template": pio.templates[charts.TEMPLATE].to_plotly_json()}}


def _banner(report: Report, data: PageData) -> str:
    name, meaning = _VERDICTS[report.verdict]
    if report.remainder.text:
        meaning = _BUT_FOR_FORM.get(report.verdict, meaning)
    lines = "".join(
        f'<div class="effect"><b>{html.escape(data.words.title(f.element))}</b> on the {html.escape(f.path)} path, '
        f"confidence {100 * f.confidence:.0f} %: {html.escape(values_in_words(f.parameters))}</div>"
        for f in report.effects
    )
    gap = report.gap.held_out
    share = (
        f"<div>Held-out gap {gap.base_refitted:.3g} N → {gap.final:.3g} N "
        f"(noise {gap.noise_floor:.3g} N): {100 * gap.closed:.1f} % of what could be closed.</div>"
        if report.effects and gap.closed is not None
        else ""
    )
    return f'<div class="verdict {report.verdict}"><b>{name}.</b> {meaning}{lines}{share}</div>'


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    header = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><tr>{header}</tr>{body}</table>"


def _effects_table(report: Report, data: PageData) -> str:
    rows = [
        (
            data.words.title(f.element),
            f.path,
            data.words.equation(f.element),
            f"{100 * f.confidence:.0f} %",
            values_in_words(f.parameters),
            f"{f.gap_before:.3g} → {f.gap_after:.3g} N",
            _alternatives(f, data),
        )
        for f in report.effects
    ]
    return _table(
        ("effect", "path", "equation", "confidence", "parameters", "gap without → with it", "could also be"), rows
    )


def _alternatives(effect: NamedEffect, data: PageData) -> str:
    """What the effect could be instead, by likelihood; and what fits as well but is less simple."""
    texts = [f"{data.words.title(a.element)} {100 * a.confidence:.0f} %" for a in effect.alternatives]
    alike = [data.words.title(n) for good in data.as_good if good.element == effect.element for n in good.others]
    if alike:
        texts.append(f"as good a fit, less simple: {', '.join(alike)}")
    return "; ".join(texts) or "none worth naming"


def _aliases(data: PageData) -> str:
    return f"<p>What no motion of the actuator can tell:</p>{_list(data.aliases)}" if data.aliases else ""


def _ruled_out(data: PageData) -> str:
    """Every candidate that no name is left of, where it came closest."""
    t = data.ruled_out
    if not t.elements:
        return ""
    columns = zip(t.elements, t.beside, t.left, t.promised, t.parameters, strict=True)
    rows = [
        (data.words.title(name), beside, f"{100.0 * left:.1f} %" if left < 1.0 else "all of it",
         f"{100 * promised:.0f} %", str(parameters))
        for name, beside, left, promised, parameters in columns
    ]  # fmt: skip
    head = (
        "tried, not named",
        "beside",
        "energy of the gap left after a full fit",
        "promised by its signature",
        "parameters",
    )
    return _table(head, rows)


def _base_table(data: PageData) -> str:
    t, rows = data.base, []
    columns = zip(t.titles, t.parameters, t.units, t.given, t.now, t.std, t.held, strict=True)
    for title, parameter, unit, given, now, std, held in columns:
        change = f"{100 * (now / given - 1):+.1f} %" if given else "–"
        unknown = std > TEXT.unknown * abs(now)
        spread = "not determined" if unknown else f"± {std:.2g}" if not np.isnan(std) else ("held" if held else "")
        rows.append((title, parameter, f"{given:.5g}", f"{now:.5g}", spread, change, unit))
    return _table(("element", "parameter", "as given", "now", "", "change", "unit"), rows)
