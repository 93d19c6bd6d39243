"""Equations of the modifiers: factors on the dissipative sum, over position, velocity, temperature and the travel since
the last reversal."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined
from identification.physical.elements.catalogue import code_of

_POSITION, _FADE = code_of("position_dependent_damping"), code_of("temperature_fade")
_ZONE, _CAVITATION = code_of("zone_damping"), code_of("cavitation")
_LEAST = 1e-12  # of the factor after a reversal, and of the speed of an onset, m/s: they divide


class Factor(NamedTuple):
    """A factor, with its slopes by z and w and, relative to itself, that by its memory."""

    m: float
    by_z: float
    by_w: float
    by_memory: float


class Fade(NamedTuple):
    kappa: float
    T_ref: float


@inlined
def fade(q, temperature):
    """exp(−kappa (T − T_ref)), and its relative partials."""
    m = np.exp(-q.kappa * (temperature - q.T_ref))
    return Factor(m, 0.0, 0.0, 0.0), Fade(-(temperature - q.T_ref), q.kappa)


@inlined
def reversal(length, travel):
    """1 − exp(−s/length), s the travel since the last reversal, and its relative partial by length."""
    far = travel / length  # before the first reversal beyond all bounds
    e = np.exp(-far)
    m = max(1.0 - e, _LEAST)
    return Factor(m, 0.0, 0.0, e / length / m), -(far * e) / length / m


class Zone(NamedTuple):
    gain: float
    z_0: float
    half: float
    edge: float


@compiled  # and not inlined, as `cavitation`: few models hold one
def zone(q, z):
    """1 + gain (tanh((z − z_0 + half)/edge) − tanh((z − z_0 − half)/edge))/2, and its relative partials."""
    into, out = (z - q.z_0 + q.half) / q.edge, (z - q.z_0 - q.half) / q.edge
    low, high = np.tanh(into), np.tanh(out)
    within, low_s, high_s = 0.5 * (low - high), 0.5 * (1.0 - low * low) / q.edge, 0.5 * (1.0 - high * high) / q.edge
    m = 1.0 + q.gain * within
    by_z = q.gain * (low_s - high_s)
    inverse = 1.0 / m if m != 0.0 else 0.0
    own = q.gain * inverse
    by = Zone(within * inverse, -by_z * inverse, own * (low_s + high_s), own * (high_s * out - low_s * into))
    return Factor(m, by_z, 0.0, 0.0), by


class Position(NamedTuple):
    p: float
    gain: float
    z_0: float
    half: float
    edge: float


@inlined
def position(q, z):
    """1 + p z², and what a zone adds to it, with the relative partials."""
    m, by_z, by_gain, by_z_0, by_half, by_edge = 1.0 + q.p * z * z, 2.0 * q.p * z, 0.0, 0.0, 0.0, 0.0
    if q.gain != 0.0:
        more, by = zone(Zone(q.gain, q.z_0, q.half, q.edge), z)
        m, by_z = m + more.m - 1.0, by_z + more.by_z
        by_gain, by_z_0, by_half, by_edge = more.m * by.gain, more.m * by.z_0, more.m * by.half, more.m * by.edge
    part = 1.0 / m if m != 0.0 else 0.0
    by_p = part * z * z
    return Factor(m, by_z, 0.0, 0.0), Position(by_p, part * by_gain, part * by_z_0, part * by_half, part * by_edge)


class Cavitation(NamedTuple):
    w_on: float
    m: float


@compiled
def cavitation(q, w):
    """min(1, (w_on/|w|)^m) where w has the sign of w_on, and its relative partials."""
    s = 1.0 if q.w_on >= 0.0 else -1.0
    onset, speed = max(s * q.w_on, _LEAST), s * w
    if speed <= onset:
        return Factor(1.0, 0.0, 0.0, 0.0), Cavitation(0.0, 0.0)
    part = np.log(onset / speed)
    m = np.exp(q.m * part)
    return Factor(m, 0.0, -s * q.m * m / speed, 0.0), Cavitation(s * q.m / onset, part)


@inlined
def modifier(code, p, o, at, travel, dp):
    """Factor of the element with that code; its relative partials from dp[o] on."""
    if code == _POSITION:
        factor, by = position(Position(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at.z)
        dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    elif code == _FADE:
        factor, by = fade(Fade(p[o], p[o + 1]), at.temperature)
        dp[o], dp[o + 1] = by
    elif code == _ZONE:
        factor, by = zone(Zone(p[o], p[o + 1], p[o + 2], p[o + 3]), at.z)
        dp[o], dp[o + 1], dp[o + 2], dp[o + 3] = by
    elif code == _CAVITATION:
        factor, by = cavitation(Cavitation(p[o], p[o + 1]), at.w)
        dp[o], dp[o + 1] = by
    else:
        factor, dp[o] = reversal(p[o], travel)
    return factor
