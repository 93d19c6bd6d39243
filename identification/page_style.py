"""How pages of results look: light, dark and on paper; plotly's own JavaScript goes in once."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator, Sequence

import plotly.graph_objects as go

__all__ = ["CLEAR", "COLOURS", "LAYOUT", "ON_PAPER", "STYLE", "document", "drawn", "plots", "table"]

# Contrast of at least 3 on white and on the dark ground of the page.
COLOURS = ("#1a8f8f", "#d1495b", "#b07d00", "#4a86c5", "#5a9a4e", "#a565c4", "#c96f2f", "#808890")
CLEAR = "rgba(0,0,0,0)"  # grounds, text and lines are coloured by the page's style: light, dark, print
LAYOUT = {
    "template": "plotly_white",
    "font": {"family": "system-ui, sans-serif", "size": 13},
    "paper_bgcolor": CLEAR,
    "plot_bgcolor": CLEAR,
    "modebar": {"bgcolor": CLEAR},
    "margin": {"l": 70, "r": 20, "t": 64, "b": 56},
}
STYLE = """
:root{color-scheme:light dark;--ink:#17212b;--soft:#51606d;--line:#d6dde3;--ground:#fff;--head:#f2f5f7}
@media screen and (prefers-color-scheme:dark){
:root{--ink:#e4eaef;--soft:#a5b3bf;--line:#34414c;--ground:#18212a;--head:#22303b}}
body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2rem auto;padding:0 1rem;
color:var(--ink);background:var(--ground)}
h1{font-size:1.6rem;margin:0 0 .5rem}h2{font-size:1.15rem;margin:2rem 0 .5rem}
.signs{background:#fff;border:1px solid var(--line);max-width:722px}.signs svg{display:block;max-width:100%;height:auto}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
td,th{padding:.25rem .55rem;border-bottom:1px solid var(--line);text-align:right;vertical-align:bottom}
th{font-weight:600;background:var(--head)}th[colspan]{text-align:center}
td{white-space:nowrap}td:first-child,th:first-child{text-align:left}.note,li{color:var(--soft)}
.plot text:not(.hoverlayer *){fill:var(--ink)!important}
.plot .gridlayer path,.plot .zerolinelayer path{stroke:var(--line)!important}
@media print{@page{size:A4;margin:12mm}body{max-width:none;margin:0;padding:0;font-size:12px}table{font-size:10.5px}
td,th{padding:.15rem .3rem}h2{break-after:avoid}.plot,table,.signs{break-inside:avoid}.modebar{display:none}}
"""
# A chart does not follow the width of paper by itself; A4 and Letter are wider than this.
ON_PAPER = """<script>
const charts=()=>document.querySelectorAll(".js-plotly-plot");
addEventListener("beforeprint",()=>charts().forEach(c=>Plotly.relayout(c,{width:680})));
addEventListener("afterprint",()=>charts().forEach(c=>Plotly.relayout(c,{width:null,autosize:true})));
</script>"""


def drawn(figure: go.Figure, *, first: bool) -> str:
    """A figure as a part of a page; the first brings the JavaScript."""
    text = figure.to_html(full_html=False, include_plotlyjs=first, config={"displaylogo": False, "responsive": True})
    return f'<div class="plot">{text}</div>'


def document(title: str, parts: Iterable[str]) -> str:
    """The whole page from the HTML of its parts."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">'
        f'<meta name="viewport" content="width=device-width"><title>{html.escape(title)}</title>'
        f"<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n"
    )


def table(head: str, rows: Iterable[Sequence[str]]) -> str:
    """A table from the HTML of its head's rows and of its cells."""
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>" for cells in rows)
    return f'<div class="wide"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'


def plots(figures: Iterable[go.Figure]) -> Iterator[str]:
    """The figures, the first with the script that draws them all; and what fits them to paper."""
    for number, figure in enumerate(figures):
        yield drawn(figure, first=number == 0)
    yield ON_PAPER
