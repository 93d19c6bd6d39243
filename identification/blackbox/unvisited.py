"""Where a motion goes that the training never went: displacement, velocity and current taken together.

Each may lie within its range and their combination be new: a reversal where the training has none, a rest where it
never rested, a current between two. No part that is left out in cross-validation shows what a black box does there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.samples import Course
from identification.models.motion import Motion
from identification.signals import SIGNALS

Floats = NDArray[np.float64]

# Distance from the nearest sample of the training, of the range of each signal there. Of 63 cuts of one record each 31
# have such samples; half: 43; double: 10, and a rest of 16 % of a record that no training has is not among them.
FAR = 0.1

TOGETHER = ("displacement", "velocity", "current")
"""Signals that are taken together, as far as a model sees them."""

_SEEN = 20_000  # samples of the training that are compared, evenly: half or double: nothing but the time


def unvisited(courses: Sequence[Course], motion: Motion, signals: Sequence[str]) -> list[str]:
    """A sentence where samples of a motion lie far from all of the training, some signals taken together; or none."""
    if not signals:
        return []
    every = np.concatenate([_columns(one.motion, signals)[one.counted] for one in courses])
    varies = np.ptp(every, axis=0) > 0.0
    signals = [name for name, one in zip(signals, varies, strict=True) if one]
    if len(signals) < 2:
        return []  # the range of one signal is told of each
    trained, span = every[:, varies], np.ptp(every[:, varies], axis=0)
    far = _distances(trained / span, _columns(motion, signals) / span) > FAR
    if not far.any():
        return []
    names = f"{', '.join(signals[:-1])} and {signals[-1]}"
    return [
        f"{100.0 * np.mean(far):.3g} % of the samples lie more than {100.0 * FAR:g} % of the trained range from all of "
        f"the training, {names} taken together, first at {int(np.argmax(far)) * motion.dt:.4g} s"
    ]


def _columns(motion: Motion, signals: Sequence[str]) -> Floats:
    held = motion.held()
    return np.column_stack([getattr(held, SIGNALS[one]) for one in signals])


def _distances(trained: Floats, shown: Floats) -> Floats:
    """From each row to the nearest one of the training, (N,)."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only where a run is held out

    tree = cKDTree(trained[:: max(1, len(trained) // _SEEN)])
    return np.asarray(tree.query(shown)[0])
