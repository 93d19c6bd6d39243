"""The look that the plots of the studies share; colours and grounds are those of `identification.page_style`."""

from __future__ import annotations

import plotly.graph_objects as go

from identification.page_style import LAYOUT


def styled(figure: go.Figure, title: str, height: int = 420) -> go.Figure:
    """The figure with the look that all have: its legend below, which leaves a narrow screen its width."""
    legend = {"orientation": "h", "x": 0.0, "xanchor": "left", "y": -0.2, "yanchor": "top", "itemsizing": "constant"}
    return figure.update_layout(height=height, title=title, showlegend=True, legend=legend, **LAYOUT)
