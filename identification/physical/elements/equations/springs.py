"""Equations of the spring family: forces that follow from the position alone."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined
from identification.physical.elements.catalogue import code_of

_STIFFNESS, _CUBIC = code_of("linear_stiffness"), code_of("cubic_stiffness")
_GAS, _STOP = code_of("gas_spring"), code_of("end_stop")


class Gas(NamedTuple):
    f0: float
    length: float
    n: float


@inlined
def gas(q, z):
    """−f0 (1 + z/length)^(−n), held finite where the chamber would be empty."""
    b = max(1.0 + z / q.length, 0.02)
    g = b ** (-q.n)
    slope = q.f0 * q.n * g / b
    return -q.f0 * g, slope / q.length, Gas(-g, -slope * z / (q.length * q.length), q.f0 * g * np.log(b))


class Stop(NamedTuple):
    k: float
    z_max: float


@inlined
def stop(q, z):
    """k max(0, z − z_max) − k max(0, −z_max − z)."""
    f, f_z, by = 0.0, 0.0, Stop(0.0, 0.0)
    if abs(z) > q.z_max:
        sgn = 1.0 if z > 0 else -1.0
        f, f_z = q.k * (z - sgn * q.z_max), q.k
        by = Stop(z - sgn * q.z_max, -sgn * q.k)
    return f, f_z, by


@inlined
def spring(code, p, o, z, dp, wanted):
    """Force of the element with that code and its slope by z; where `wanted`, its partials from dp[o] on."""
    if code == _STIFFNESS:
        f, f_z = p[o] * z, p[o]
        if wanted:
            dp[o] = z
    elif code == _CUBIC:
        f, f_z = p[o] * z * z * z, 3.0 * p[o] * z * z
        if wanted:
            dp[o] = z * z * z
    elif code == _GAS:
        f, f_z, by = gas(Gas(p[o], p[o + 1], p[o + 2]), z)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2] = by
    else:
        f, f_z, by = stop(Stop(p[o], p[o + 1]), z)
        if wanted:
            dp[o], dp[o + 1] = by
    return f, f_z
