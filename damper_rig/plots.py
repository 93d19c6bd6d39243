"""One call for a picture of anything."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from damper_rig.analysing import Analysed
from damper_rig.comparing import Compared, compare
from damper_rig.explaining import Explained
from damper_rig.fitting import Fitted
from damper_rig.runs import listed
from damper_rig.sheets import Sheet
from excitation import Excitation, TestPlan
from excitation.plots import figures
from identification.analysis.charts import force_spectrum, over_levels
from identification.discrepancy.ladder import ladder_of
from identification.models import motion_of
from identification.models.comparison_page import forces
from identification.models.simulation import name_of
from identification.sheet.charts import peak_velocity
from rigctl.runfile import Run

__all__ = ["plot"]

_POINTS: Final = 4000  # of a run, from its end: a screen shows no more
_COLOURS: Final = ("#00798c", "#d1495b", "#e0a800", "#30638e", "#6a994e", "#7b2d8b", "#b56576", "#4d4d4d")


def plot(
    what: Run | Iterable[Run] | Fitted | Explained | Compared | Sheet | Analysed | Excitation | TestPlan,
) -> go.Figure:
    """The picture that says most of it.

    Runs: force over displacement and velocity. A fit or a comparison: every model over the measured force. An
    explanation: the gap at each step. A sheet: force at peak speed. An
    analysis: the spectrum of the force, of several levels their distortion. An excitation: its signals. A plan: its
    tests.
    """
    match what:
        case Fitted():
            return forces(compare({"start": what.start, "fitted": what.model}, what.runs).result)
        case Compared():
            return forces(what.result)
        case Explained():
            return ladder_of(what.result)
        case Analysed():
            return _analysed(what)
        case Sheet():
            return peak_velocity(what.result.currents)
        case Excitation() | TestPlan():
            return figures(what)[0]
        case _:
            return _loops(listed(what))


def _analysed(what: Analysed) -> go.Figure:
    if len(what.levels) == 1:
        return force_spectrum(what.levels[0].found)
    return over_levels([(one.setting.text, one.found) for one in what.levels])


def _loops(runs: list[Run]) -> go.Figure:
    """Force over displacement and over velocity, a colour for each run."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=("force over displacement", "force over velocity"))
    for k, run in enumerate(runs):
        motion, force = motion_of(run), run.channels["force"]
        size = min(motion.x.size, force.size)
        last = slice(max(size - _POINTS, 0), size)
        line = {"color": _COLOURS[k % len(_COLOURS)], "width": 1.5}
        for column, axis in ((1, 1e3 * motion.x), (2, motion.v)):
            figure.add_scattergl(
                x=axis[last], y=force[last], mode="lines", name=name_of(run), legendgroup=str(k),
                showlegend=column == 1, line=line, row=1, col=column,
            )  # fmt: skip
    figure.update_xaxes(title="displacement, mm", row=1, col=1)
    figure.update_xaxes(title="velocity, m/s", row=1, col=2)
    figure.update_yaxes(title="force, N", row=1, col=1)
    return figure.update_layout(height=460, template="plotly_white")
