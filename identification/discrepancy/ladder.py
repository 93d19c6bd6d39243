"""The gap of an explanation at each step, as a picture."""

from __future__ import annotations

import plotly.graph_objects as go

from identification.discrepancy.curves import gap_interval
from identification.discrepancy.explanation import Explanation, Gaps
from identification.report.charts import TEMPLATE, ladder
from identification.report.report_file import BothGaps, Gap


def ladder_of(e: Explanation) -> go.Figure:
    """The gap at each step, as the page of the report draws it."""
    ends = [gap_interval([t for t in e.traces if t.held_out is held]) for held in (False, True)]
    last = "with the named effects" if e.effects else "final"
    figure = ladder(BothGaps(train=_gap(e.train), held_out=_gap(e.held_out)), ends[0], ends[1], last)
    return figure.update_layout(template=TEMPLATE)


def _gap(gaps: Gaps) -> Gap:
    return Gap(
        as_given=gaps.as_given,
        base_refitted=gaps.base_refitted,
        final=gaps.final,
        noise_floor=gaps.noise_floor,
        closed=gaps.closed,
    )
