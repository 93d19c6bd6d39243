"""What a black box adds to its force where an input lies outside of its training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]


def added_outside(model: SimulationModel, motion: Motion) -> Floats:
    """How far the force moves when every input is cut at the edge of its training, (N,), N; 0 along a motion inside.

    Nothing that was measured supports this part of the force, and no error in cross-validation says how wrong it is: a
    band takes all of it for a standard deviation.
    """
    known = model.training_range
    if known is None or not known.left(motion):
        return np.zeros(motion.x.size)
    return np.asarray(np.abs(model.force(motion) - model.force(known.inside(motion))))
