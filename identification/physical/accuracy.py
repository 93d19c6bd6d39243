"""How far the solver's own discretisation carries a simulated force from the exact answer."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.physical.model import Element, Model
from identification.physical.motion import Motion
from identification.physical.simulate import simulate

Floats = NDArray[np.float64]

_SMOOTH, _EVENTS = 5, 2  # order of the method for a force that is smooth, and for one that jumps or remembers


@dataclass(frozen=True, slots=True)
class NumericalError:
    """Estimated error of each sample of the force (N,), N, its rms, and that over the rms of the force."""

    force: Floats
    rms: float
    relative: float


def numerical_error(model: Model, motion: Motion) -> NumericalError:
    """Error of `simulate(model, motion)` by Richardson's rule from half the step: 2^p/(2^p − 1)·(F_h − F_h/2).

    The method is of order p = 5 where the force is smooth; with dry friction, free play or a memory it is of second
    order, and at a stick, an impact or a reversal of first: the estimate is then a third too small.
    Between samples the motion is the cubic that the solver itself follows.
    """
    coarse = simulate(model, replace(motion, settle=0)).force
    fine = simulate(model, _halved(replace(motion, settle=0))).force[::2]
    factor = 2.0 ** _order(model)
    error = (coarse - fine) * factor / (factor - 1.0)
    error[0] = error[1]  # the first sample is a convention, not a step
    rms = float(np.sqrt(np.mean(error**2)))
    return NumericalError(error, rms, rms / max(float(np.sqrt(np.mean(fine**2))), 1e-300))


def _order(model: Model) -> int:
    events = any(e.spec.memory or e.name == "free_play" or _jumps(e) for e in model.elements)
    return _EVENTS if events else _SMOOTH


def _jumps(e: Element) -> bool:
    return e.name in ("coulomb_friction", "stribeck_friction") and e.value("w_r") == 0.0


def _halved(motion: Motion) -> Motion:
    """The motion with a sample between every two, (2 N − 1,): cubic in x, with v and a its derivatives."""
    dt = motion.dt
    return replace(
        motion,
        dt=0.5 * dt,
        x=_between(motion.x, 0.5 * _pairs(motion.x) - dt / 8.0 * np.diff(motion.v)),
        v=_between(motion.v, 1.5 * np.diff(motion.x) / dt - 0.25 * _pairs(motion.v)),
        a=_between(motion.a, np.diff(motion.v) / dt),
        i=_between(motion.i, 0.5 * _pairs(motion.i)),
        temperature=_between(motion.temperature, 0.5 * _pairs(motion.temperature)),
        t=_between(motion.t, 0.5 * _pairs(motion.t)),
        period=0,
    )


def _pairs(s: Floats) -> Floats:
    return s[1:] + s[:-1]


def _between(s: Floats, middle: Floats) -> Floats:
    out = np.empty(2 * s.size - 1)
    out[::2], out[1::2] = s, middle
    return out
