"""How long a free run remembers where it started: runs from far apart, until they are one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.scaling import Scale

Floats = NDArray[np.float64]

_FORGOTTEN = 0.01  # of the size of the force: runs that are nearer than this are one


def remembered(run: Callable[[float], Floats], scale: Scale) -> float:
    """Samples until free runs are and stay as one, infinite where they are apart at the end.

    `run` gives the force (N,), N, from a scaled force before it: the lowest and the highest that the model can give,
    and the mean, from which every free run begins. Two from the edges alone could meet where that one never is.
    """
    forces = np.array([run(before) for before in (scale.edges[0], 0.0, scale.edges[1])])
    late = np.flatnonzero(np.ptp(forces, axis=0) > _FORGOTTEN * scale.size)
    if not late.size:
        return 0.0
    return float(np.inf) if late[-1] + 1 == forces.shape[1] else float(late[-1] + 1)
