"""Dry friction and what remembers: forces that follow from the direction of sliding and from an element's memory."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import compiled, inlined
from identification.physical.elements import Code

_BOUC_WEN, _COULOMB, _STRIBECK = int(Code.BOUC_WEN), int(Code.COULOMB), int(Code.STRIBECK)
_PRESLIDING = int(Code.PRESLIDING)


@inlined
def sign(w, eps):
    """Sign of a velocity; within round-off of rest it is neither."""
    if w > eps:
        return 1.0
    if w < -eps:
        return -1.0
    return 0.0


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


@inlined
def friction(code, p, o, w, s, u, m, dp, dm, k, wanted):
    """Force, its slopes by w and u, and the height of its step at rest; `dm[k]` is the slope by the memory `m`."""
    f, f_w, f_u, jump = 0.0, 0.0, 0.0, 0.0
    if code == _BOUC_WEN:  # (alpha + alpha_control u) h
        f = (p[o] + p[o + 5] * u) * m
        f_u = p[o + 5] * m
        dm[k] = p[o] + p[o + 5] * u
        if wanted:
            dp[o] = m
            dp[o + 1] = 0.0
            dp[o + 2] = 0.0
            dp[o + 3] = 0.0
            dp[o + 4] = 0.0
            dp[o + 5] = u * m
    elif code == _COULOMB:  # f_c sgn(w), or f_c w / sqrt(w² + w_r²) where it builds up over w_r
        y, y_w, y_r = _sliding(w, s, p[o + 1])
        f = p[o] * y
        f_w = p[o] * y_w
        jump = p[o] if p[o + 1] == 0.0 else 0.0
        if wanted:
            dp[o] = y
            dp[o + 1] = p[o] * y_r
    elif code == _STRIBECK:  # (f_c + (f_s − f_c) exp(−(w/w_s)²)) sgn(w), the sign as in Coulomb friction
        y, y_w, y_r = _sliding(w, s, p[o + 3])
        q = w / p[o + 2]
        e = np.exp(-q * q)
        rise = p[o + 1] - p[o]
        level = p[o] + rise * e
        f = level * y
        f_w = level * y_w - y * rise * e * 2.0 * q / p[o + 2]
        jump = p[o + 1] if p[o + 3] == 0.0 else 0.0
        if wanted:
            dp[o] = y * (1.0 - e)
            dp[o + 1] = y * e
            dp[o + 2] = y * rise * e * 2.0 * q * q / p[o + 2]
            dp[o + 3] = level * y_r
    elif code == _PRESLIDING:  # its force is its memory
        f = m
        dm[k] = 1.0
        if wanted:
            dp[o] = 0.0
            dp[o + 1] = 0.0
    return f, f_w, f_u, jump


@inlined
def bristle_level(p, o, w):
    """g(w) = f_c + (f_s − f_c) exp(−(w/w_s)²) of the LuGre friction, its slope by w, and the exponential."""
    q = w / p[o + 4]
    e = np.exp(-q * q)
    rise = p[o + 3] - p[o + 2]
    return p[o + 2] + rise * e, -2.0 * rise * e * q / p[o + 4], e


@compiled
def bristles(p, o, w, m, dp, dm, k):
    """LuGre friction sigma0 m + sigma1 dm/dt, dm/dt = w − sigma0 |w| m/g(w), and its slope by w; `dm[k]` as above."""
    g, g_w, e = bristle_level(p, o, w)
    share = p[o] * m / g
    rate = w - abs(w) * share
    sgn = 1.0 if w > 0 else -1.0
    by_g = p[o + 1] * abs(w) * share / g
    f = p[o] * m + p[o + 1] * rate
    f_w = p[o + 1] * (1.0 - sgn * share) + by_g * g_w
    dm[k] = p[o] - p[o + 1] * abs(w) * p[o] / g
    q = w / p[o + 4]
    dp[o] = m - p[o + 1] * abs(w) * m / g
    dp[o + 1] = rate
    dp[o + 2] = by_g * (1.0 - e)
    dp[o + 3] = by_g * e
    dp[o + 4] = by_g * (p[o + 3] - p[o + 2]) * e * 2.0 * q * q / p[o + 4]
    return f, f_w
