"""The leading periods that have not settled."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.criteria import HEAD, UNSETTLED, UNSETTLED_HEAD

__all__ = ["unsettled_periods"]

Floats = NDArray[np.float64]


def unsettled_periods(force: Floats) -> int:
    """How many leading periods of (P, N) still hold a transient, 0 … P − 1; 0 where one period is all there is.

    A period has settled where its difference from the mean of the later ones, less an offset, a slope and a gain of its
    own (drift and warming are no transient), is not above what differs between the later ones, and is not concentrated
    at its start. With two periods only the second can be seen.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012: periodic signals, of which
    the first periods are left out until the response repeats.
    """
    drop = 0
    while drop < force.shape[0] - 1 and _is_unsettled(force[drop], force[drop + 1 :]):
        drop += 1
    return drop


def _is_unsettled(period: Floats, later: Floats) -> bool:
    rest = _without_slow_change(period, later.mean(axis=0))
    power = rest * rest
    head = max(int(HEAD * rest.size), 1)
    tiny = float(np.finfo(np.float64).eps * np.max(np.abs(period), initial=0.0)) ** 2
    first, after = float(np.mean(power[:head])), float(np.mean(power[head:]))
    if first > UNSETTLED_HEAD * after + tiny * rest.size:
        return True
    if later.shape[0] < 2:
        return False
    apart = np.array([_without_slow_change(b, a) for a, b in pairwise(later)])
    noise = 0.5 * float(np.mean(apart * apart)) * (1.0 + 1.0 / later.shape[0])
    return bool(float(np.mean(power)) > UNSETTLED * noise + tiny * rest.size)


def _without_slow_change(period: Floats, mean: Floats) -> Floats:
    """The difference of a period from the mean, less an offset, a slope and a gain, (N,)."""
    ramp = np.linspace(-1.0, 1.0, mean.size)
    basis = np.linalg.qr(np.column_stack([np.ones(mean.size), ramp, mean]))[0]
    rest = period - mean
    out: Floats = rest - basis @ (basis.T @ rest)
    return out
