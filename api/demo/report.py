"""The first page of the demonstration's results: the hidden effect, the findings, links to the reports."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from api.client import Campaign
from api.demo.demonstration import Demonstration, Finding
from api.errors import InputError
from excitation.atomic import written_whole
from identification.report.report_file import Value
from identification.report.values import values_in_words

__all__ = ["gap_rows", "verdict_text", "write_index"]

STEPS = (
    ("as_given", "as given"),
    ("base_refitted", "refitted"),
    ("final", "with the named effect"),
    ("noise_floor", "noise floor"),
)

_RIG_TEXT = (
    "A servo-hydraulic rig with a semi-active damper, simulated in its own process, which shares no equation with "
    "the identification. The base model lacks one effect, and its parameters are off by up to a third."
)
_REAL_TEXT = (
    "Seven runs of a real magneto-rheological damper at constant coil voltage, 100 Hz, no temperature; the base model "
    "is a viscous damper. Data: A. N. Vargas, UTFPR, github.com/labcontrol-data/mr-damper, MIT licence, "
    "doi 10.5281/zenodo.4445334."
)

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1c2733; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
table { border-collapse: collapse; width: 100%; } td, th { padding: .3rem .6rem; text-align: left; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; } .w { width: 55%; }
.bar { background: #0b63a5; height: 1rem; border-radius: 2px; min-width: 1px; } .noise { background: #9aa6b2; }
.box { border-left: 4px solid #1d7a45; background: #eef7f1; padding: .6rem 1rem; }
.wrong { border-color: #b3261e; background: #fdf1f0; }
.hint { color: #5b6875; font-size: .9rem; } a.report { font-weight: 600; }
tr + tr td { border-top: 1px solid #e6eaee; }
"""


def verdict_text(finding: Finding) -> str:
    """The verdict and the names in one line."""
    report = finding.report
    names = [f"{e['element']} ({e['path']} path), confidence {e['confidence']:.2f}" for e in report["effects"]]
    return f"{str(report['verdict']).replace('_', ' ')}" + (f": {'; '.join(names)}" if names else "")


def gap_rows(finding: Finding) -> list[tuple[str, float]]:
    """The gaps on held-out runs, N rms: as given, refitted, with the named effect, noise floor."""
    gap = finding.report["gap"]["held_out"]
    return [(text, float(gap[key])) for key, text in STEPS]


def write_index(demonstration: Demonstration, path: Path) -> None:
    """Write the page whole or not at all; it opens offline and links the two reports beside it."""
    with written_whole(path, InputError) as temporary:
        temporary.write_text(_page(demonstration, path.parent), encoding="utf-8")


def _page(demonstration: Demonstration, folder: Path) -> str:
    truth = ", ".join(demonstration.truth)
    found = ", ".join(demonstration.named) or "nothing"
    box = "box" if demonstration.named_right else "box wrong"
    seed = f"Seed {demonstration.asked.seed}. " + ("" if demonstration.asked.effect else "It selects the effect.")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>damper-rig: demonstration</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>{_STYLE}</style></head><body>
<h1>What is the simulation missing?</h1>
<p class="{box}">Hidden in the simulated rig: <strong>{escape(truth)}</strong>. Found from the measurements alone:
<strong>{escape(found)}</strong>. <span class="hint">{escape(seed)}</span></p>
{_section(demonstration.rig, folder, _RIG_TEXT)}
{_tests(demonstration.campaign)}
{_section(demonstration.real, folder, _REAL_TEXT)}
</body></html>
"""


def _section(finding: Finding, folder: Path, text: str) -> str:
    rows = gap_rows(finding)
    most = max(value for _, value in rows) or 1.0
    gaps = "".join(
        f'<tr><td>{escape(name)}</td><td class="n">{value:.4g} N</td><td class="w"><div class="bar'
        f'{" noise" if name == "noise floor" else ""}" style="width:{100 * value / most:.2f}%"></div></td></tr>'
        for name, value in rows
    )
    closed = finding.report["gap"]["held_out"].get("closed")
    share = "" if closed is None else f"{100 * closed:.1f} % of the reducible gap is closed. "
    link = escape((finding.folder / "report.html").relative_to(folder).as_posix())
    effects = "".join(f"<li>{_effect(effect)}</li>" for effect in finding.report["effects"])
    return f"""<h2>{escape(finding.title)}</h2><p>{escape(text)}</p>
<p><strong>{escape(verdict_text(finding))}</strong></p><ul>{effects}</ul>
<p>Measured minus simulated force on runs that no fit has seen, rms:</p><table>{gaps}</table>
<p>{share}<a class="report" href="{link}">The full report</a>
<span class="hint">({finding.seconds:.1f} s of computing)</span></p>"""


def _effect(effect: Mapping[str, Any]) -> str:
    values = values_in_words({name: Value(**entry) for name, entry in effect["parameters"].items()})
    others = ", ".join(f"{a['element']} {a['confidence']:.2f}" for a in effect["alternatives"])
    text = f"<strong>{escape(effect['element'])}</strong>: {escape(values)}"
    return text + (f'. <span class="hint">Alternatives: {escape(others)}</span>' if others else "")


def _tests(campaign: Campaign) -> str:
    rows = "".join(
        f"<tr><td>{escape(test.name)}</td><td>{escape(test.kind)}</td>"
        f"<td>{'held out' if test.held_out else 'training'}</td>"
        f'<td class="n">{test.duration_s:.1f} s</td><td class="n">{test.samples}</td></tr>'
        for test in campaign.tests
    )
    return (
        "<table><thead><tr><th>Test</th><th>Kind</th><th>Use</th><th class='n'>Rig time</th>"
        f"<th class='n'>Samples</th></tr></thead>{rows}</table>"
        "<p class='hint'>The run files are in <code>runs/</code>, the service's store in <code>service/</code>.</p>"
    )
