"""The report: report.json for programs, report.html for people, model.json for the next simulation."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from excitation.plan import plan_from_config
from excitation.plan_files import write_plan
from identification.discrepancy import charts
from identification.discrepancy.aliases import aliases
from identification.discrepancy.excess import excess_of
from identification.discrepancy.explanation import Effect, Explanation, Verdict, report_data
from identification.discrepancy.trials import Trial, allowance
from identification.physical.elements import CATALOGUE
from identification.physical.modelfile import write_model
from rigctl.durable import replacing

_VERDICTS = {
    Verdict.NO_DISCREPANCY: (
        "No discrepancy",
        "With its parameters fitted, the simulation meets the data down to the noise.",
    ),
    Verdict.EXPLAINED: (
        "Explained",
        "The named effects bring the gap down to the noise, on runs that no fit has seen.",
    ),
    Verdict.PARTLY_EXPLAINED: ("Partly explained", "The named effects shrink the gap; something repeatable stays."),
    Verdict.UNKNOWN_EFFECT: ("Unknown effect", "There is a repeatable gap that no element of the catalogue explains."),
}

_BUT_FOR_FORM = "The named effects close the gap, but for what their canonical forms may miss of real ones."

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#1b1b1b;max-width:1080px;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.6rem;margin:0}
h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid #ddd;padding-bottom:.2rem}
.verdict{border-left:8px solid #00798c;background:#f2f7f8;padding:1rem 1.2rem;margin:1rem 0}
.verdict.unknown_effect{border-color:#d1495b;background:#fbf3f4}.verdict.partly_explained{border-color:#e0a800;background:#fdf9ec}
.verdict b{font-size:1.25rem}.effect{margin:.4rem 0}table{border-collapse:collapse;width:100%;font-size:14px}
td,th{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #e5e5e5;vertical-align:top}th{background:#f6f6f6}
td.n{font-variant-numeric:tabular-nums;text-align:right}p.note,li{color:#444}code{background:#f3f3f3;padding:0 .25rem}
@media print{body{max-width:none;margin:0}h2{break-after:avoid}.plot,table{break-inside:avoid}}
"""


def write_report(explanation: Explanation, directory: Path, *, reproduce: str = "") -> Path:
    """Write report.json, report.html and model.json into `directory`; returns the path of report.html.

    Where a further test is worth its rig time, next_test.toml is a plan of that test, ready for `damper-rig run`.
    `reproduce` is the command that makes the report again. Each file is complete under its name, or not there.
    """
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "next_test.toml").unlink(missing_ok=True)
    if design := explanation.next_test.design:
        write_plan(directory / "next_test.toml", plan_from_config({"tests": [dict(design)]}))
    data = json.dumps(report_data(explanation), indent=2, ensure_ascii=False, allow_nan=False)
    write_model(directory / "model.json", explanation.model)
    with replacing(directory / "report.json") as temporary:
        temporary.write_text(data + "\n", encoding="utf-8")
    with replacing(directory / "report.html") as temporary:
        temporary.write_text(report_html(explanation, reproduce=reproduce), encoding="utf-8")
    return directory / "report.html"


def report_html(e: Explanation, *, reproduce: str = "") -> str:
    """The whole report as one page that opens offline."""
    title = f"{e.given.name or 'Simulation'}: what it is missing"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">'
        f"<title>{html.escape(title)}</title>"
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head><body>'
        f"{report_body(e, reproduce=reproduce)}</body></html>\n"
    )


def report_body(e: Explanation, *, reproduce: str = "", plotly: bool = True) -> str:
    """The report without the frame of a page, to stand in a page of its own or beside others.

    `plotly` says whether this part brings the JavaScript that draws, which a page needs once.
    """
    held = [t for t in e.traces if t.held_out] or list(e.traces)
    figures = [charts.ladder(e)]
    where = [charts.map_of_gap(e), charts.profiles(e)] if e.verdict != Verdict.NO_DISCREPANCY else []
    before_after = [charts.loops(t) for t in held[:3]] + [charts.spectrum(held)]
    evidence = [f for f in (charts.shapes_of_names(e), charts.rivals(e), charts.strengths(e)) if f is not None]
    parts = [
        f"<h1>{html.escape(e.given.name or 'Simulation')}</h1>",
        _banner(e),
        _plots(figures, plotly),
        _section("Named effects", _effects_table(e) + _aliases(e)) if e.effects else "",
        _section("Where the simulation and the measurement disagree", _where_list(e) + _plots(where, False))
        if where
        else "",
        _section("Measured against simulated, before and after", _plots(before_after, False)),
        _section("Evidence, and what was ruled out", _plots(evidence, False) + _ruled_out(e)) if evidence else "",
        _section("What stays", f"<p>{html.escape(e.remainder)}</p>") if e.remainder else "",
        _section("The next test", f"<p>{html.escape(e.next_test.text)}</p>{_design(e)}") if e.next_test.text else "",
        _section("How far the base moved", _base_table(e)),
        _section("How each run was read", "<ul>" + "".join(f"<li>{html.escape(n)}</li>" for n in e.notes) + "</ul>"),
        _section("Make this report again", f"<p><code>{html.escape(reproduce)}</code></p>") if reproduce else "",
    ]
    return "".join(parts)


def _design(e: Explanation) -> str:
    """The test as a table, and how to play it."""
    lines = "\n".join(f"{key} = {json.dumps(value)}" for key, value in e.next_test.design.items())
    play = "damper-rig run next_test.toml --rig ADDRESS -o runs"
    over_http = "beside this report on the command line; over HTTP the same table is a test of a campaign"
    return f"<pre>{html.escape(lines)}</pre><p><code>{play}</code>, {over_http}</p>" if lines else ""


def _section(title: str, content: str) -> str:
    return f"<h2>{title}</h2>{content}"


def _plots(figures: Iterable[go.Figure], plotly: bool) -> str:
    out = []
    for figure in figures:
        out.append(
            '<div class="plot">'
            + figure.to_html(
                full_html=False, include_plotlyjs=plotly, config={"displaylogo": False, "responsive": True}
            )
            + "</div>"
        )
        plotly = False
    return "".join(out)


def _banner(e: Explanation) -> str:
    name, meaning = _VERDICTS[e.verdict]
    if e.verdict == Verdict.EXPLAINED and e.remainder:
        meaning = _BUT_FOR_FORM
    lines = "".join(
        f'<div class="effect"><b>{html.escape(CATALOGUE[f.element].title)}</b> on the {f.path} path, '
        f"confidence {100 * f.confidence:.0f} %: {html.escape(_main_value(f.parameters))}</div>"
        for f in e.effects
    )
    closed = e.held_out.closed
    share = (
        f"<div>Held-out gap {e.held_out.base_refitted:.3g} N → {e.held_out.final:.3g} N "
        f"(noise {e.held_out.noise_floor:.3g} N): {100 * closed:.1f} % of what could be closed.</div>"
        if e.effects and closed is not None
        else ""
    )
    return f'<div class="verdict {e.verdict}"><b>{name}.</b> {meaning}{lines}{share}</div>'


def _main_value(parameters: object) -> str:
    assert isinstance(parameters, dict)
    return ", ".join(_value(name, *entry) for name, entry in parameters.items() if not _neutral(entry))


def _neutral(entry: tuple[float, float | None, str]) -> bool:
    return entry[0] == 0.0 and entry[1] is None


def _value(name: str, value: float, std: float | None, unit: str) -> str:
    spread = f" ± {std:.2g}" if std is not None else ""
    return f"{name} = {value:.4g}{spread} {unit}".rstrip("– ")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    header = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><tr>{header}</tr>{body}</table>"


def _effects_table(e: Explanation) -> str:
    rows = [
        (
            CATALOGUE[f.element].title,
            f.path,
            CATALOGUE[f.element].equation,
            f"{100 * f.confidence:.0f} %",
            _main_value(f.parameters),
            f"{f.gap_before:.3g} → {f.gap_after:.3g} N",
            _alternatives(e, f),
        )
        for f in e.effects
    ]
    return _table(
        ("effect", "path", "equation", "confidence", "parameters", "gap without → with it", "could also be"), rows
    )


def _alternatives(e: Explanation, f: Effect) -> str:
    """What the effect could be instead, by likelihood; and what fits as well but is less simple."""
    words = [f"{CATALOGUE[n].title} {100 * c:.0f} %" for n, c in f.alternatives]
    tried = e.compared[f.element].rivals if f.element in e.compared else ()
    own = [t for t in tried if t.name == f.element]
    known = {f.element, *(n for n, _ in f.alternatives), *e.compared}
    alike = [t for t in tried if t.name not in known and t.excess <= own[0].excess + allowance(own[0], t)]
    if alike:
        words.append(f"as good a fit, less simple: {', '.join(CATALOGUE[t.name].title for t in alike)}")
    return "; ".join(words) or "none worth naming"


def _aliases(e: Explanation) -> str:
    lines = "".join(f"<li>{html.escape(text)}</li>" for text in aliases([f.element for f in e.effects]))
    return f"<p>What no motion of the actuator can tell:</p><ul>{lines}</ul>" if lines else ""


def _where_list(e: Explanation) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(r.text)}</li>" for r in e.where) + "</ul>"


def _ruled_out(e: Explanation) -> str:
    """Every candidate that no name is left of, where it came closest."""
    named = {f.element for f in e.effects}
    closest: dict[str, tuple[float, Trial, str]] = {}
    for left, trial, beside in _tried(e):
        if trial.name not in named and left < closest.get(trial.name, (np.inf,))[0]:
            closest[trial.name] = (left, trial, beside)
    rows = [
        (CATALOGUE[t.name].title, beside, f"{100.0 * left:.1f} %" if left < 1.0 else "all of it",
         f"{100 * t.screened:.0f} %", str(t.parameters))
        for left, t, beside in sorted(closest.values(), key=lambda row: row[0])
    ]  # fmt: skip
    if not rows:
        return ""
    head = (
        "tried, not named",
        "beside",
        "energy of the gap left after a full fit",
        "promised by its signature",
        "parameters",
    )
    return _table(head, rows)


def _tried(e: Explanation) -> Iterator[tuple[float, Trial, str]]:
    """Share of the gap that each candidate left, and what stood beside it."""
    for compared in e.compared.values():
        for t in compared.rivals:
            yield max(t.excess, 0.0) / max(excess_of(compared.start), 1e-300), t, charts.beside(compared)
    for move in e.moves[:1]:
        for t in move.rivals:
            yield max(t.excess, 0.0) / max(move.excess_before, 1e-300), t, "beside the base alone"


def _base_table(e: Explanation) -> str:
    fitted = {
        f"{x.name}.{s.name}": p for x in e.model.elements for s, p in zip(x.spec.parameters, x.parameters, strict=True)
    }
    rows = []
    for x in e.given.elements:
        for spec, p in zip(x.spec.parameters, x.parameters, strict=True):
            now = fitted.get(f"{x.name}.{spec.name}", p)
            change = f"{100 * (now.value / p.value - 1):+.1f} %" if p.value else "–"
            spread = f"± {now.std:.2g}" if now.std is not None else ("held" if now.fixed else "")
            rows.append((x.spec.title, spec.name, f"{p.value:.5g}", f"{now.value:.5g}", spread, change, spec.unit))
    return _table(("element", "parameter", "as given", "now", "", "change", "unit"), rows)
