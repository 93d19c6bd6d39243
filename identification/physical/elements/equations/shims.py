"""A bleed orifice beside a shim stack and a blow-off: their flows add, and the force follows from the sum."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled
from identification.physical.elements.equations.point import Force


class Shims(NamedTuple):
    q: float
    f_open: float
    c_shim: float
    f_blow: float
    c_blow: float


@compiled  # and not inlined: few models hold it, and its size would slow down all other curves
def shim_stack(q, at):
    """The force F of |w| = √(F/q) + max(0, F − f_open)/c_shim + max(0, F − f_blow)/c_blow, with the sign of w.

    With r = √F every region is a r² + b r = |w| + d: a = Σ 1/c and d = Σ f/c over the valves that are open, b = 1/√q.
    A valve is open where the speed is above that at which the others pass its opening force. The partials are those of
    the implicit function: ∂F/∂θ = −(∂w/∂θ)/(∂w/∂F).
    """
    speed, s = abs(at.w), (1.0 if at.w > 0.0 else -1.0)
    b, by_shim, by_blow = 1.0 / np.sqrt(q.q), 1.0 / q.c_shim, 1.0 / q.c_blow
    opens = b * np.sqrt(q.f_open) + max(0.0, q.f_open - q.f_blow) * by_blow
    blows = b * np.sqrt(q.f_blow) + max(0.0, q.f_blow - q.f_open) * by_shim
    shim = by_shim if speed > opens else 0.0
    blow = by_blow if speed > blows else 0.0
    a, total = shim + blow, speed + shim * q.f_open + blow * q.f_blow
    root = np.sqrt(b * b + 4.0 * a * total)
    r = 2.0 * total / (b + root)
    f, slope = r * r, 2.0 * r / root  # root = b + 2 a r
    by = Shims(
        s * slope * 0.5 * r * b / q.q,
        s * slope * shim,
        s * slope * shim * shim * (f - q.f_open),
        s * slope * blow,
        s * slope * blow * blow * (f - q.f_blow),
    )
    return Force(s * f, 0.0, slope, 0.0, 0.0, 0.0, 0.0), by
