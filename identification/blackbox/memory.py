"""How long a free run remembers where it started: two runs from far apart, until they are one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FORGOTTEN = 0.01  # of the size of the force: two runs that are nearer than this are one


def remembered(one: Floats, other: Floats, size: float) -> float:
    """Samples until two forces (N,), N, are and stay as one; infinite where they are apart at the end."""
    late = np.flatnonzero(np.abs(one - other) > _FORGOTTEN * size)
    if not late.size:
        return 0.0
    return float(np.inf) if late[-1] + 1 == one.size else float(late[-1] + 1)
