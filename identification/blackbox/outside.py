"""What nothing that was measured supports of the force of a black box: where the motion leaves its training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]


def unsupported(model: SimulationModel, motion: Motion, swing: float) -> Floats:
    """√(a² + (swing·d)²), (N,), N, taken for a standard deviation of the force; 0, or nearly, along a motion of
    the training.

    a is what the model adds outside (see `added_outside`). d is the distance from all of the training, signals taken
    together, of their ranges (see `Visited.beyond`), and `swing` the usual rms force about its mean, N: a force that
    is in proportion to a signal changes by √12 of that over the range, so that what a model says of it is taken to
    be wrong by a third of it. Half and double: that part of the band is half and twice as wide.
    """
    added, known = added_outside(model, motion), model.training_range
    if known is None or known.together is None:
        return added
    return np.hypot(added, swing * known.together.beyond(motion))


def added_outside(model: SimulationModel, motion: Motion) -> Floats:
    """How far the force moves when every input is cut at the edge of its training, (N,), N; 0 along a motion inside.

    Nothing that was measured supports this part of the force, and no error in cross-validation says how wrong it is: a
    band takes all of it for a standard deviation.
    """
    known = model.training_range
    if known is None or not known.left(motion):
        return np.zeros(motion.x.size)
    return np.asarray(np.abs(model.force(motion) - model.force(known.inside(motion))))
