"""A recorded signal that is a copy of another one: it tells a model nothing, or the force that it is to give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.samples import Course
from identification.errors import DataError
from identification.signals import SIGNALS
from rigctl.runfile import Run

Floats = NDArray[np.float64]

OWN = ("current", "temperature")
"""Signals that have a sensor of their own. Displacement and its derivatives are left out: along one sine the
acceleration is the displacement."""

# Correlation above which a signal is a copy of another: they differ by 1e-4 of their size. A hundredth of that: such a
# copy is not seen where one of them was smoothed; a hundred times: a current that is made from the motion, with noise
# of one percent, is refused.
_SAME = 1.0 - 0.5e-8


def check_distinct(runs: Sequence[Run], courses: Sequence[Course], names: Sequence[str]) -> None:
    """Raise DataError where one of the signals in `names` is another one times a constant, but for an offset.

    Compared are channels and signals that are learned: the smoothing of a displacement hides that a current was
    recorded from it, and a velocity that was not recorded is known only from the motion.
    """
    check_copies(runs, names)
    _check({name: np.concatenate([one.series(name)[one.counted] for one in courses]) for name in names}, names)


def check_copies(runs: Sequence[Run], names: Sequence[str]) -> None:
    """The same of the channels as the `runs` hold them: the signals in `names`, and the measured force."""
    compared = [one for one in SIGNALS if one in names]
    recorded = [one for one in (*compared, "force") if all(one in run.channels for run in runs)]
    _check({name: np.concatenate([run.channels[name] for run in runs]) for name in recorded}, names)


def _check(series: Mapping[str, Floats], names: Sequence[str]) -> None:
    for name in (one for one in OWN if one in names and one in series):
        for other in series:
            if other != name and _alike(series[name], series[other]):
                what = "tells what the model is to give" if other == "force" else "tells nothing"
                raise DataError(
                    f"{name} is {other} times a constant in all runs: a duplicate {what}; "
                    f"leave one of them out of the regressors, or record its own {name}"
                )


def _alike(one: Floats, other: Floats) -> bool:
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return False
    return abs(float(np.corrcoef(one, other)[0, 1])) > _SAME
