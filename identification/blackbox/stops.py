"""Stop operators: what a displacement leaves behind at its reversals, as friction and yielding know it.

s(t) = min(max(s(t − 1) + x(t) − x(t − 1), −r), r): a spring of travel r behind which all slides (Prandtl 1928; Brokate
and Sprekels, Hysteresis and Phase Transitions, 1996). It is bounded by r whatever the displacement, and forgets all
that was before a motion of 2·r in one direction. A network that sees some of them follows loops of friction without
feeding its own force back.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from identification.compiled import compiled

Floats = NDArray[np.float64]

# The limit r of each by its symbol, of the rms of the displacement in training: steps of half a decade up to all of it,
# and between them. Force builds up over 2 to 60 % of the stroke on the measured dampers. Of simulated dampers in a
# random motion, those whose memory has many widths lose a fifth of their error by the denser row; measured sines none.
LIMITS: Mapping[str, float] = {"P": 0.03, "Q": 0.1, "R": 0.3, "S": 1.0, "U": 0.055, "V": 0.17, "W": 0.55}


def stopped(travel: Floats, limit: float) -> Floats:
    """The stop operator of a scaled travel (N,), as a share of its limit, (N,); it begins at 0."""
    out = np.empty(travel.size)
    _stopped(travel, limit, out)
    return out


def stopped_once(before: float, moved: float, limit: float) -> float:
    """The same one sample later: the share of the limit after the travel has `moved`."""
    return min(max(before + moved / limit, -1.0), 1.0)


@compiled
def _stopped(travel, limit, out):
    s = 0.0
    for t in range(travel.size):
        s += (travel[t] - travel[t - 1]) / limit if t > 0 else 0.0
        s = s if s < 1.0 else 1.0
        s = s if s > -1.0 else -1.0
        out[t] = s
