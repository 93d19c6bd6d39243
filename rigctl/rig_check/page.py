"""The protocol of a rig check as one HTML page that opens offline and prints on paper."""

from __future__ import annotations

import re
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.atomic import written_whole
from rigctl.errors import RunFileError
from rigctl.rig_check.protocol import Finding, Protocol, Verdict

__all__ = ["file_name", "protocol_page", "write_protocol"]

BARS: Final = 40
WIDTH: Final = 640
HEIGHT: Final = 120
MARKS: Final = {Verdict.GOOD: "✓", Verdict.NOTE: "", Verdict.BAD: "✗"}
STYLE: Final = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #1d232a; }
h1 { font-size: 1.5rem; margin-bottom: .2rem; } h2 { font-size: 1.05rem; margin: 1.6rem 0 .4rem; }
p.verdict { font-weight: 600; } .good { color: #17693a; } .bad { color: #a1131c; }
table { border-collapse: collapse; width: 100%; } td, th { text-align: left; padding: .3rem .6rem .3rem 0;
vertical-align: top; border-bottom: 1px solid #d9dee3; } th { font-weight: 600; color: #57606a; }
td:first-child { width: 36%; } td:nth-child(3) { width: 24%; color: #57606a; } td:last-child { width: 1.5rem; }
svg text { font-size: 11px; fill: #57606a; } .sign td { height: 3rem; }
@media print { body { margin: 0; max-width: none; } h2 { break-after: avoid; } tr { break-inside: avoid; } }
"""


def write_protocol(path: Path, protocol: Protocol) -> None:
    """Write the page, whole or not at all; RunFileError where the place cannot be written."""
    with written_whole(path, RunFileError) as temporary:
        temporary.write_text(protocol_page(protocol), encoding="utf-8")


def file_name(protocol: Protocol) -> str:
    """Name of a protocol that is kept: rig and time."""
    rig = protocol.identity
    return re.sub(r"[^\w.+-]+", "_", f"rig-check-{rig.model}-{rig.serial}-{protocol.made_at[:19]}") + ".html"


def protocol_page(protocol: Protocol) -> str:
    """The page as text: every finding by part, the distribution of the round trips, and lines to sign."""
    identity = protocol.identity
    title = escape(f"Rig check: {identity.vendor} {identity.model} {identity.serial}")
    moved = any(one.part == "motion" and one.verdict is not Verdict.NOTE for one in protocol.findings)
    bad = sum(one.verdict is Verdict.BAD for one in protocol.findings)
    verdict = (
        "Nothing wrong was found" if protocol.passed else f"{bad} {'finding is' if bad == 1 else 'findings are'} bad"
    )
    scope = "without motion and with 1 mm" if moved else "without motion"
    sections = "".join(
        f"<h2>{escape(part.capitalize())}</h2>{_table(tuple(rows))}{_trips(protocol) if part == 'wire' else ''}"
        for part, rows in groupby(protocol.findings, key=lambda one: one.part)
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"<h1>{title}</h1><p>{escape(protocol.url)}, {escape(protocol.made_at)}, {scope}"
        f"{', by ' + escape(protocol.operator) if protocol.operator else ''}</p>"
        f'<p class="verdict {"good" if protocol.passed else "bad"}">{verdict}.</p>{sections}'
        "<h2>To be checked by hand</h2>"
        "<p>This page says nothing of what must be hard-wired: the emergency stop, the guards, the relief of the "
        "pressure. See docs/safety.md.</p>"
        '<table class="sign"><tr><td>Emergency stop pressed under power: pressure off</td><td></td><td>signed</td></tr>'
        "<tr><td>Guard opened under power: pressure off</td><td></td><td>signed</td></tr></table></html>\n"
    )


def _table(findings: tuple[Finding, ...]) -> str:
    rows = "".join(
        f"<tr><td>{escape(one.what)}</td><td>{escape(one.found)}</td>"
        f"<td>{escape(one.wanted)}</td>"
        f'<td class="{one.verdict}" title="{one.verdict}">{MARKS[one.verdict]}</td></tr>'
        for one in findings
    )
    return f"<table><tr><th>what</th><th>found</th><th>wanted</th><th></th></tr>{rows}</table>"


def _trips(protocol: Protocol) -> str:
    """Histogram of the round trips on a logarithmic axis, as SVG."""
    trips = 1e3 * protocol.round_trips_s
    low, high = np.log10(max(float(trips.min()), 1e-3)) - 0.05, np.log10(max(float(trips.max()), 2e-3)) + 0.05
    counts, edges = np.histogram(np.log10(np.maximum(trips, 1e-3)), bins=BARS, range=(low, high))
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + 34}" width="{WIDTH}" role="img" aria-label="round trips">'
        f"{_bars(counts, edges, low, high)}{_axis(low, high)}</svg>"
    )


def _bars(counts: NDArray[np.int_], edges: NDArray[np.float64], low: float, high: float) -> str:
    left, scale = WIDTH * (edges[:-1] - low) / (high - low), HEIGHT / max(int(counts.max()), 1)
    return "".join(
        f'<rect x="{x:.1f}" y="{HEIGHT - scale * n:.1f}" width="{WIDTH / BARS - 1:.1f}" height="{scale * n:.1f}" '
        'fill="#4a78a8"/>'
        for x, n in zip(left, counts, strict=True)
        if n
    )


def _axis(low: float, high: float) -> str:
    ticks = [m * 10.0**d for d in range(int(np.floor(low)), int(np.ceil(high)) + 1) for m in (1, 2, 5)]
    shown = [
        (value, WIDTH * (np.log10(value) - low) / (high - low)) for value in ticks if low <= np.log10(value) <= high
    ]
    marks = "".join(
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{HEIGHT}" y2="{HEIGHT + 4}" stroke="#57606a"/>'
        f'<text x="{x:.1f}" y="{HEIGHT + 17}" text-anchor="middle">{value:g}</text>'
        for value, x in shown
    )
    line = f'<line x1="0" x2="{WIDTH}" y1="{HEIGHT}" y2="{HEIGHT}" stroke="#57606a"/>'
    return f'{line}{marks}<text x="0" y="{HEIGHT + 31}">round trip of an exchange, ms</text>'
