"""Equations of the modifiers: factors on the dissipative sum, over position, temperature and the travel since the last
reversal."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined
from identification.physical.elements.catalogue import code_of

_POSITION, _FADE = code_of("position_dependent_damping"), code_of("temperature_fade")
_LEAST = 1e-12  # of the factor after a reversal: it divides


class Factor(NamedTuple):
    """A factor, with its slope by z and, relative to itself, that by its memory."""

    m: float
    by_z: float
    by_memory: float


class Fade(NamedTuple):
    kappa: float
    T_ref: float


@inlined
def position(p, z):
    """1 + p z², and its relative partial by p."""
    m = 1.0 + p * z * z
    return Factor(m, 2.0 * p * z, 0.0), (z * z / m if m != 0.0 else 0.0)


@inlined
def fade(q, temperature):
    """exp(−kappa (T − T_ref)), and its relative partials."""
    m = np.exp(-q.kappa * (temperature - q.T_ref))
    return Factor(m, 0.0, 0.0), Fade(-(temperature - q.T_ref), q.kappa)


@inlined
def reversal(length, travel):
    """1 − exp(−s/length), s the travel since the last reversal, and its relative partial by length."""
    far = travel / length  # before the first reversal beyond all bounds
    e = np.exp(-far)
    m = max(1.0 - e, _LEAST)
    return Factor(m, 0.0, e / length / m), -(far * e) / length / m


@inlined
def modifier(code, p, o, at, travel, dp):
    """Factor of the element with that code; its relative partials from dp[o] on."""
    if code == _POSITION:
        factor, dp[o] = position(p[o], at.z)
    elif code == _FADE:
        factor, by = fade(Fade(p[o], p[o + 1]), at.temperature)
        dp[o], dp[o + 1] = by
    else:
        factor, dp[o] = reversal(p[o], travel)
    return factor
