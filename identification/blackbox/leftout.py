"""What the parts that a model was not learned from show of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import LeftOut
from identification.blackbox.samples import Course
from identification.blackbox.swing import swing_of

Floats = NDArray[np.float64]


def left_out_of(shown: Sequence[tuple[Course, Floats, Floats | float]]) -> LeftOut:
    """Errors, spreads and swings of what counts of some courses, from the simulated force of each, (N,), N, and its
    spread."""
    parts = []
    for course, force, spread in shown:
        whole = force if course.model is None else force + course.model
        columns = np.broadcast_arrays(course.force - force, spread, swing_of(whole, course.motion))
        parts.append(np.array(columns)[:, course.counted])
    return LeftOut(*np.concatenate(parts, axis=1))
