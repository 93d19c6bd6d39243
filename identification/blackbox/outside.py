"""Where a motion leaves the training of a black box, and how wide its band is there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.band import Band, Place
from identification.blackbox.swing import swing_of
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel, TrainingRange

Floats = NDArray[np.float64]
NOWHERE = TrainingRange({})
"""The range of a model that states none: no motion leaves it."""


def half_width_along(
    model: SimulationModel, band: Band, motion: Motion, level: float, force: Floats, spread: Floats | float = 0.0
) -> Floats:
    """Half of the width of a band along a motion of which a model simulates a force, with the spread of its members,
    each (N,), N."""
    known = model.training_range or NOWHERE
    return band.half_width(place_along(known, motion, force, spread, model.force), level)


def place_along(
    known: TrainingRange, motion: Motion, force: Floats, spread: Floats | float, again: Callable[[Motion], Floats]
) -> Place:
    """Where a motion lies beside what was learned, and the force (N,), N, that a model gives; `again` simulates it
    along another motion."""
    zeros = np.zeros(motion.x.size)
    apart, past = (zeros, zeros) if known.together is None else known.together.away(motion)
    return Place(
        spreads=spread + zeros,
        swings=swing_of(force, motion),
        added=added_outside(known, motion, force, again),
        apart=apart,
        past=past,
    )


def added_outside(known: TrainingRange, motion: Motion, force: Floats, again: Callable[[Motion], Floats]) -> Floats:
    """How far a force (N,), N, moves when every input is cut at the edge of the training, (N,); 0 inside.

    Nothing that was measured supports this part of the force, and parts that are left out show it rarely: a band takes
    all of it for a standard deviation.
    """
    if not known.left(motion):
        return np.zeros(motion.x.size)
    return np.asarray(np.abs(force - again(known.inside(motion))))
