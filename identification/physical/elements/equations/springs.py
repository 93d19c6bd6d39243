"""Equations of the spring family: forces that follow from the position, and for a warm gas from the temperature."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined
from identification.physical.elements.catalogue import code_of

_STIFFNESS, _CUBIC = code_of("linear_stiffness"), code_of("cubic_stiffness")
_GAS, _STOP, _PROGRESSIVE = code_of("gas_spring"), code_of("end_stop"), code_of("progressive_stop")
_WARM_GAS, _KELVIN, _USUAL_C = code_of("warm_gas_spring"), 273.15, 25.0


class Cubic(NamedTuple):
    k3: float
    bend: float


@inlined
def cubic(q, z):
    """k3 z³/(1 + bend z²), its slope by z and its partials."""
    square = z * z
    less = 1.0 / (1.0 + q.bend * square)
    shape = square * z * less
    return (
        q.k3 * shape,
        q.k3 * square * (3.0 + q.bend * square) * less * less,
        Cubic(shape, -q.k3 * shape * square * less),
    )


class Gas(NamedTuple):
    f0: float
    length: float
    n: float
    heat: float
    rested: float
    warm: float


@inlined
def gas_of(p, o):
    """The parameters of a gas spring by name."""
    return Gas(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4], p[o + 5])


class Rise(NamedTuple):
    """(1 + z/length)^(n − 1), what y tends to, and its partials by z, length and n."""

    y: float
    by_z: float
    by_length: float
    by_n: float


@inlined
def _opening(q, z):
    """1 + z/length, held above zero where the chamber would be empty."""
    return max(1.0 + z / q.length, 0.02)


@inlined
def tended_to(q, z):
    """See `Rise`."""
    b = _opening(q, z)
    y = b ** (q.n - 1.0)
    slope = (q.n - 1.0) * y / b
    return Rise(y, slope / q.length, -slope * z / (q.length * q.length), y * np.log(b))


@inlined
def gas(q, z, temperature, behind):
    """−f0 w y (1 + z/length)^(−n), y = (1 + z/length)^(n−1) + `behind`, w = 1 + warm (T − 25 °C)/298.15 K; its slopes
    by z and `behind`, its partials.

    Where no heat passes the wall y is 1, and `behind`, a memory that it has not, 0.
    """
    b, warmer = _opening(q, z), (temperature - _USUAL_C) / (_USUAL_C + _KELVIN)
    pressure = b ** (-q.n)
    g = pressure * (1.0 + q.warm * warmer)
    rise = tended_to(q, z) if q.heat != 0.0 else Rise(1.0, 0.0, 0.0, 0.0)
    y = rise.y + behind
    slope = q.f0 * q.n * g / b * y
    f_y = -q.f0 * g
    by_length = f_y * rise.by_length - slope * z / (q.length * q.length)
    by_warm = -q.f0 * pressure * warmer * y
    by = Gas(-g * y, by_length, q.f0 * g * y * np.log(b) + f_y * rise.by_n, 0.0, 0.0, by_warm)
    return f_y * y, f_y * rise.by_z + slope / q.length, f_y, by


class WarmGas(NamedTuple):
    f0: float
    length: float
    n: float
    T_ref: float


@inlined
def warm_gas(q, z, temperature):
    """The same, its pressure in proportion to the absolute temperature."""
    scale, absolute = (temperature + _KELVIN) / (q.T_ref + _KELVIN), q.T_ref + _KELVIN
    f, f_z, _, by = gas(Gas(q.f0 * scale, q.length, q.n, 0.0, 0.0, 0.0), z, _USUAL_C, 0.0)
    return f, f_z, WarmGas(by.f0 * scale, by.length, by.n, -f / absolute)


class Stop(NamedTuple):
    k: float
    z_max: float
    side: float
    k2: float
    centre: float


@inlined
def stop(q, z):
    """(1 ± side) (k o + k2 o²), o by how far z lies farther than z_max from the centre."""
    f, f_z, by = 0.0, 0.0, Stop(0.0, 0.0, 0.0, 0.0, 0.0)
    y = z - q.centre
    if abs(y) > q.z_max:
        sgn = 1.0 if y > 0 else -1.0
        part, o = 1.0 + sgn * q.side, abs(y) - q.z_max
        met = (q.k + q.k2 * o) * o
        f, f_z = sgn * part * met, part * (q.k + 2.0 * q.k2 * o)
        by = Stop(sgn * part * o, -sgn * f_z, met, sgn * part * o * o, -f_z)
    return f, f_z, by


class Progressive(NamedTuple):
    k: float
    k2: float
    z_stop: float


@inlined
def progressive_stop(q, z):
    """s (k o + k2 o²), o = max(0, s (z − z_stop)), s the side of z_stop."""
    s = 1.0 if q.z_stop >= 0.0 else -1.0
    o = max(0.0, s * (z - q.z_stop))
    slope = q.k + 2.0 * q.k2 * o if o > 0.0 else 0.0
    return s * (q.k + q.k2 * o) * o, slope, Progressive(s * o, s * o * o, -slope)


@inlined
def spring(code, p, o, z, temperature, m, dp, wanted):
    """Force of the element with that code, its slopes by z and its memory `m`; where `wanted`, its partials in `dp`."""
    f_m = 0.0
    if code == _STIFFNESS:
        f, f_z = p[o] * z, p[o]
        if wanted:
            dp[o] = z
    elif code == _CUBIC:
        f, f_z, by = cubic(Cubic(p[o], p[o + 1]), z)
        if wanted:
            dp[o], dp[o + 1] = by
    elif code == _GAS:
        f, f_z, f_m, by = gas(gas_of(p, o), z, temperature, m)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4], dp[o + 5] = by
    elif code == _WARM_GAS:
        f, f_z, by = warm_gas(WarmGas(p[o], p[o + 1], p[o + 2], p[o + 3]), z, temperature)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3] = by
    elif code == _PROGRESSIVE:
        f, f_z, by = progressive_stop(Progressive(p[o], p[o + 1], p[o + 2]), z)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2] = by
    else:
        f, f_z, by = stop(Stop(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), z)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    return f, f_z, f_m
