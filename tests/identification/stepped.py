"""A model from sample to sample, beside the same model along a motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identification.models import Motion
from identification.models.stepping import Moment, Steppable


def moment(m: Motion, k: int) -> Moment:
    return Moment(m.x[k], m.v[k], m.a[k], m.i[k], m.temperature[k])


def stepped(model: Steppable, m: Motion, between: Callable[[int], Moment] | None = None) -> NDArray[np.float64]:
    """The force at every sample; `between` asks a question before each step."""
    stepper = model.stepper(m.dt)
    force = [stepper.start(moment(m, 0))]
    for k in range(1, m.x.size):
        if between is not None:
            stepper.force(between(k))
        force.append(stepper.advance(moment(m, k)))
    return np.array(force)
