"""What the pages of the studies share: style, dark screens, the look of a plot."""

from __future__ import annotations

from typing import Final

import plotly.graph_objects as go

COLOURS: Final = ("#00798c", "#d1495b", "#e0a800", "#7b2d8b", "#6a994e", "#e07a5f", "#5b7fde", "#8d6e63")

STYLE: Final = """:root{color-scheme:light dark}
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;background:#fff;color:#1b1b1b}
h1{font-size:1.5em;margin-bottom:.2em}.scroll{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
td,th{padding:.3em .8em;border-bottom:1px solid #8884;text-align:right}td:first-child,th:first-child{text-align:left}
p.note{color:#777}i.dot{display:inline-block;width:.75em;height:.75em;border-radius:50%;margin-right:.45em}
@media(prefers-color-scheme:dark){body{background:#15181c;color:#e6e6e6}}"""

THEME: Final = """<script>(function(){if(!matchMedia('(prefers-color-scheme:dark)').matches)return;
document.querySelectorAll('.plotly-graph-div').forEach(function(d){Plotly.relayout(d,{'paper_bgcolor':'#15181c',
'plot_bgcolor':'#15181c','font.color':'#e6e6e6','xaxis.gridcolor':'#333','yaxis.gridcolor':'#333'});});})();</script>"""
"""Behind the plots of a page: dark plots where the screen asks for dark pages."""


def styled(figure: go.Figure, title: str, height: int = 420) -> go.Figure:
    """The figure with the look that all have."""
    figure.update_layout(
        template="plotly_white",
        title=title,
        height=height,
        font={"family": "system-ui, sans-serif", "size": 13},
        margin={"l": 60, "r": 20, "t": 50, "b": 50},
        showlegend=True,
        legend={"orientation": "h", "y": -0.2},
    )
    return figure
