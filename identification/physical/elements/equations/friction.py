"""Equations of the friction family: forces that follow from the direction of sliding and from an element's memory."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined
from identification.physical.elements.catalogue import code_of
from identification.physical.elements.equations.point import Force

_BOUC_WEN, _COULOMB = code_of("bouc_wen"), code_of("coulomb_friction")
_STRIBECK, _PRESLIDING = code_of("stribeck_friction"), code_of("presliding_friction")
_SELECTIVE = code_of("frequency_selective_damping")


@inlined
def _sliding(w, s, w_r):
    """Direction of sliding and its slopes by w and w_r: the sign `s`, or smooth where friction builds up over w_r."""
    y, y_w, y_r = s, 0.0, 0.0
    if w_r > 0.0:
        root = np.sqrt(w * w + w_r * w_r)
        y = w / root
        y_w = w_r * w_r / (root * root * root)
        y_r = -w * w_r / (root * root * root)
    return y, y_w, y_r


class BoucWen(NamedTuple):
    alpha: float
    A: float
    n: float
    beta: float
    gamma: float
    alpha_control: float


@inlined
def bouc_wen(q, at, m):
    level = q.alpha + q.alpha_control * at.u
    force = Force(level * m, 0.0, 0.0, q.alpha_control * m, level, 0.0, 0.0)
    return force, BoucWen(m, 0.0, 0.0, 0.0, 0.0, at.u * m)


class Coulomb(NamedTuple):
    f_c: float
    w_r: float


@inlined
def coulomb(q, at):
    """f_c sgn(w), or f_c w / sqrt(w² + w_r²) where it builds up over w_r."""
    y, y_w, y_r = _sliding(at.w, at.s, q.w_r)
    jump = q.f_c if q.w_r == 0.0 else 0.0
    return Force(q.f_c * y, 0.0, q.f_c * y_w, 0.0, 0.0, jump, 0.0), Coulomb(y, q.f_c * y_r)


class Stribeck(NamedTuple):
    f_c: float
    f_s: float
    w_s: float
    w_r: float


@inlined
def stribeck(q, at):
    y, y_w, y_r = _sliding(at.w, at.s, q.w_r)
    x = at.w / q.w_s
    e = np.exp(-x * x)
    rise = q.f_s - q.f_c
    level = q.f_c + rise * e
    f_w = level * y_w - y * rise * e * 2.0 * x / q.w_s
    jump = q.f_s if q.w_r == 0.0 else 0.0
    by = Stribeck(y * (1.0 - e), y * e, y * rise * e * 2.0 * x * x / q.w_s, level * y_r)
    return Force(level * y, 0.0, f_w, 0.0, 0.0, jump, 0.0), by


@inlined
def presliding(m):
    """Its force is its memory."""
    return Force(m, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


@inlined
def friction(code, p, o, at, m, dp, wanted):
    """As `damping`, with the memory `m` of the element."""
    if code == _BOUC_WEN:
        force, by = bouc_wen(BoucWen(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4], p[o + 5]), at, m)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4], dp[o + 5] = by
    elif code == _COULOMB:
        force, by = coulomb(Coulomb(p[o], p[o + 1]), at)
        if wanted:
            dp[o], dp[o + 1] = by
    elif code == _STRIBECK:
        force, by = stribeck(Stribeck(p[o], p[o + 1], p[o + 2], p[o + 3]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3] = by
    elif code == _SELECTIVE:
        force = Force(p[o] * m, 0.0, 0.0, 0.0, p[o], 0.0, 0.0)
        if wanted:
            dp[o], dp[o + 1] = m, 0.0
    else:
        force = presliding(m)
        if wanted:
            dp[o], dp[o + 1] = 0.0, 0.0
    return force
