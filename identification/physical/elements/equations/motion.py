"""Equations of the motion family: elements that look at the rig's motion, its acceleration or v_m = sqrt(v² − a x), or
that carry bristles."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined
from identification.physical.elements.catalogue import code_of
from identification.physical.elements.equations.point import Force

_LUGRE, _MODULATED = code_of("lugre_friction"), code_of("modulated_tanh_hysteresis")
_BIVISCOUS = code_of("hysteretic_biviscous")


class LuGre(NamedTuple):
    sigma0: float
    sigma1: float
    f_c: float
    f_s: float
    w_s: float


@inlined
def bristle_level(q, w):
    """g(w) = f_c + (f_s − f_c) exp(−(w/w_s)²), its slope by w, and the exponential."""
    x = w / q.w_s
    e = np.exp(-x * x)
    rise = q.f_s - q.f_c
    return q.f_c + rise * e, -2.0 * rise * e * x / q.w_s, e


@inlined
def lugre(q, at, m):
    """sigma0 m + sigma1 dm/dt, dm/dt = w − sigma0 |w| m/g(w)."""
    w = at.w
    g, g_w, e = bristle_level(q, w)
    share = q.sigma0 * m / g
    rate = w - abs(w) * share
    sgn = 1.0 if w > 0 else -1.0
    by_g = q.sigma1 * abs(w) * share / g
    f_w = q.sigma1 * (1.0 - sgn * share) + by_g * g_w
    by_m = q.sigma0 - q.sigma1 * abs(w) * q.sigma0 / g
    x = w / q.w_s
    by_w_s = by_g * (q.f_s - q.f_c) * e * 2.0 * x * x / q.w_s
    by = LuGre(m - q.sigma1 * abs(w) * m / g, rate, by_g * (1.0 - e), by_g * e, by_w_s)
    return Force(q.sigma0 * m + q.sigma1 * rate, 0.0, f_w, 0.0, by_m, 0.0, 0.0), by


class ModulatedTanh(NamedTuple):
    alpha1: float
    alpha2: float
    alpha3: float
    alpha4: float
    alpha5: float
    beta1: float
    beta2: float
    delta1: float
    delta2: float


@inlined
def modulated_tanh(q, at):
    """(α1 u + α2)(α3 v_m² + α4 v_m + α5) tanh(β1 v_m^β2 w + (δ1 u + δ2) sgn z)."""
    z, w, u, v_m = at.z, at.w, at.u, at.v_m
    sz = 1.0 if z > 0 else (-1.0 if z < 0 else 0.0)
    by_u, by_v = q.alpha1 * u + q.alpha2, (q.alpha3 * v_m + q.alpha4) * v_m + q.alpha5
    power = v_m**q.beta2
    th = np.tanh(q.beta1 * power * w + (q.delta1 * u + q.delta2) * sz)
    g = by_u * by_v * (1.0 - th * th)
    f_u = q.alpha1 * by_v * th + g * q.delta1 * sz
    by = ModulatedTanh(
        u * by_v * th, by_v * th, by_u * v_m * v_m * th, by_u * v_m * th, by_u * th, g * power * w,
        g * q.beta1 * power * w * np.log(v_m), g * u * sz, g * sz,
    )  # fmt: skip
    return Force(by_u * by_v * th, 0.0, g * q.beta1 * power, f_u, 0.0, 0.0, 0.0), by


class Biviscous(NamedTuple):
    c_po: float
    c_pr: float
    f_y: float
    f_y_control: float
    v_0: float


@inlined
def biviscous(q, at):
    """c_pr (w − v_0 sgn a), held within c_po w ± (f_y + f_y_control u)."""
    w = at.w
    turn = 1.0 if at.a > 0 else (-1.0 if at.a < 0 else 0.0)
    level = q.f_y + q.f_y_control * at.u
    pre, post = q.c_pr * (w - turn * q.v_0), q.c_po * w
    f, f_w, f_u, by = pre, q.c_pr, 0.0, Biviscous(0.0, w - turn * q.v_0, 0.0, 0.0, -q.c_pr * turn)
    if not abs(pre - post) < level:
        sgn = 1.0 if pre > post else -1.0
        f, f_w, f_u, by = post + sgn * level, q.c_po, sgn * q.f_y_control, Biviscous(w, 0.0, sgn, sgn * at.u, 0.0)
    return Force(f, 0.0, f_w, f_u, 0.0, 0.0, 0.0), by


class Sigmoid(NamedTuple):
    F_t: float
    F_t_control: float
    alpha: float
    h: float
    k_v: float


@inlined
def sigmoid(q, at):
    """(F_t + F_t_control u) tanh(alpha (w − h v_m sgn a)/2) (1 + k_v |w|)."""
    w = at.w
    turn = 1.0 if at.a > 0 else (-1.0 if at.a < 0 else 0.0)
    level, rise = q.F_t + q.F_t_control * at.u, 1.0 + q.k_v * abs(w)
    y = w - q.h * at.v_m * turn
    th = np.tanh(0.5 * q.alpha * y)
    g = 0.5 * level * rise * (1.0 - th * th)
    f_w = g * q.alpha + level * th * q.k_v * (1.0 if w > 0 else -1.0)
    by = Sigmoid(th * rise, at.u * th * rise, g * y, -g * q.alpha * at.v_m * turn, level * th * abs(w))
    return Force(level * th * rise, 0.0, f_w, q.F_t_control * th * rise, 0.0, 0.0, 0.0), by


@compiled  # and not inlined: the size of these would slow down all the others
def motion_force(code, p, o, at, m, dp):
    """As `friction`; the partials are always written."""
    if code == _LUGRE:
        force, by_l = lugre(LuGre(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at, m)
        dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by_l
    elif code == _MODULATED:
        q = ModulatedTanh(
            p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4], p[o + 5], p[o + 6], p[o + 7], p[o + 8],
        )  # fmt: skip
        force, by_m = modulated_tanh(q, at)
        for j in range(9):
            dp[o + j] = by_m[j]
    elif code == _BIVISCOUS:
        force, by_b = biviscous(Biviscous(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by_b
    else:
        force, by_s = sigmoid(Sigmoid(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by_s
    return force
