"""Equations of the damping family: forces that follow from velocity, position and current at the same moment."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined
from identification.physical.elements.catalogue import code_of
from identification.physical.elements.equations.point import Force
from identification.physical.elements.equations.shims import Shims, shim_stack

_VISCOUS, _ARCTAN = code_of("viscous_damping"), code_of("arctan_damping")
_PIECEWISE, _VALVE = code_of("piecewise_linear_damping"), code_of("valve_damping")
_QUADRATIC, _RELIEF = code_of("quadratic_damping"), code_of("relief_valve")
ASYMMETRY, _TANH = code_of("damping_asymmetry"), code_of("tanh_hysteresis")
_REBOUND_COMPRESSION = code_of("rebound_compression_damping")
_BUMP_STOP = code_of("hydraulic_bump_stop")
_EDDY, _SHIMS = code_of("eddy_current_damping"), code_of("shim_stack_damping")
STIFF = _ARCTAN  # the element that a caller with a constant code makes fastest: stiff models of the literature hold it


class Viscous(NamedTuple):
    c: float
    c_control: float


@inlined
def viscous(q, at):
    c = q.c + q.c_control * at.u
    return Force(c * at.w, 0.0, c, q.c_control * at.w, 0.0, 0.0, 0.0), Viscous(at.w, at.u * at.w)


class Arctan(NamedTuple):
    F1: float
    S: float
    d: float
    F2: float


@inlined
def arctan(x):
    """Arctangent to two units in the last place (Moshier, Cephes 1987): no call, so that three of them overlap."""
    y = abs(x)
    far, mid = y > 2.414213562373095, y > 0.66
    top = -1.0 if far else (y - 1.0 if mid else y)
    bottom = y if far else (y + 1.0 if mid else 1.0)
    base = 1.5707963267948966 if far else (0.7853981633974483 if mid else 0.0)
    r = top / bottom
    q = r * r
    q2 = q * q
    above = (-0.8750608600031904122785 * q2 + (-16.15753718737365076637 * q - 75.00855792314704667340)) * q2
    above += -122.8866684490136173410 * q - 64.85021904942025371773
    below = ((q + 24.85846490142306297962) * q2 + (165.0270098316988542046 * q + 432.8810604912902668951)) * q2
    below += 485.3903996359136964868 * q + 194.5506571482613964425
    angle = base + (r * (q * above / below) + r)
    return angle if x >= 0.0 else -angle


@inlined
def arctan_damping(q, at):
    sw = q.S * at.w
    a = 2.0 / np.pi * arctan(sw)
    b = 2.0 / np.pi / (1.0 + sw * sw)
    force = Force(q.F1 * a + q.d * at.w, 0.0, q.F1 * b * q.S + q.d, 0.0, 0.0, 0.0, q.F2)
    return force, Arctan(a, q.F1 * b * at.w, at.w, 1.0)


class Piecewise(NamedTuple):
    c1: float
    c2: float
    f_r: float


@inlined
def piecewise_linear(q, at):
    w = at.w
    f, f_w, by_c1, by_c2, by_f_r = q.c1 * w, q.c1, w, 0.0, 0.0
    if not abs(q.c1 * w) < q.f_r:
        sgn = 1.0 if w > 0 else -1.0
        f = sgn * (1.0 - q.c2 / q.c1) * q.f_r + q.c2 * w
        f_w = q.c2
        by_c1 = sgn * q.f_r * q.c2 / (q.c1 * q.c1)
        by_c2 = w - sgn * q.f_r / q.c1
        by_f_r = sgn * (1.0 - q.c2 / q.c1)
    return Force(f, 0.0, f_w, 0.0, 0.0, 0.0, 0.0), Piecewise(by_c1, by_c2, by_f_r)


class Valve(NamedTuple):
    c_soft: float
    c_firm: float
    u_soft: float
    u_firm: float
    w_knee: float


@inlined
def valve(q, at):
    """c(u) is linear between u_soft and u_firm and clipped outside."""
    span, w = q.u_firm - q.u_soft, at.w
    r, inside = 0.0, 0.0
    if span != 0.0:
        r = (at.u - q.u_soft) / span
        inside = 1.0 if 0.0 < r < 1.0 else 0.0
        r = min(max(r, 0.0), 1.0)
    c = q.c_soft + (q.c_firm - q.c_soft) * r
    y = w / q.w_knee
    g = 1.0 / np.sqrt(1.0 + y * y)
    dr = (q.c_firm - q.c_soft) * w * g * inside / span if span != 0.0 else 0.0
    force = Force(c * w * g, 0.0, c * g * g * g, dr, 0.0, 0.0, 0.0)
    return force, Valve((1.0 - r) * w * g, r * w * g, -(1.0 - r) * dr, -r * dr, c * g * g * g * y * y * y)


class Quadratic(NamedTuple):
    q: float
    w_cap: float


@inlined
def quadratic(q, at):
    speed, sgn = abs(at.w), 1.0 if at.w > 0 else -1.0
    if 0.0 < q.w_cap < speed:
        own = sgn * q.w_cap * q.w_cap
        return Force(q.q * own, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), Quadratic(own, 2.0 * q.q * sgn * q.w_cap)
    own = at.w * speed
    return Force(q.q * own, 0.0, 2.0 * q.q * speed, 0.0, 0.0, 0.0, 0.0), Quadratic(own, 0.0)


class Relief(NamedTuple):
    c_drop: float
    w_knee: float
    c_drop_control: float
    w_round: float


@inlined
def relief(q, at):
    """Minus the drop of the slope times a hyperbola with the asymptotes 0 and |w| − w_knee, less its value at rest."""
    speed, sgn, c = abs(at.w), 1.0 if at.w > 0 else -1.0, q.c_drop + q.c_drop_control * at.u
    over = speed - q.w_knee
    near, rest = np.sqrt(over * over + q.w_round * q.w_round), np.sqrt(q.w_knee * q.w_knee + q.w_round * q.w_round)
    slope = over / near if near > 0.0 else 0.0
    own = -0.5 * sgn * (speed + near - rest)
    by_knee = 0.5 * c * sgn * (slope + q.w_knee / rest)
    by_round = 0.5 * c * sgn * q.w_round * (1.0 / rest - 1.0 / near) if near > 0.0 else 0.0
    force = Force(c * own, 0.0, -0.5 * c * (1.0 + slope), q.c_drop_control * own, 0.0, 0.0, 0.0)
    return force, Relief(own, by_knee, at.u * own, by_round)


class Asymmetry(NamedTuple):
    c_a: float
    c_a_control: float
    share: float


SHARE = Asymmetry._fields.index("share")


@inlined
def asymmetry(q, at):
    """Without the part in proportion to the other curves, which `core.lean` adds."""
    c, speed = q.c_a + q.c_a_control * at.u, abs(at.w)
    f_w = c * (1.0 if at.w > 0 else -1.0)
    return Force(c * speed, 0.0, f_w, q.c_a_control * speed, 0.0, 0.0, 0.0), Asymmetry(speed, at.u * speed, 0.0)


class ReboundCompression(NamedTuple):
    c_r: float
    w_r: float
    c_c: float
    w_c: float
    share: float


@inlined
def rebound_compression(q, at):
    """c·w·(share + (1 − share)/√(1 + (w/w_knee)²)) with the slope and the knee of the side."""
    rebound = at.w > 0.0
    c, knee = (q.c_r, q.w_r) if rebound else (q.c_c, q.w_c)
    y = at.w / knee
    g = 1.0 / np.sqrt(1.0 + y * y)
    part, bend = q.share + (1.0 - q.share) * g, (1.0 - q.share) * g * g * g
    by_c, by_knee = at.w * part, c * bend * y * y * y
    by_share = c * at.w * (1.0 - g)
    force = Force(c * by_c, 0.0, c * (q.share + bend), 0.0, 0.0, 0.0, 0.0)
    if rebound:
        return force, ReboundCompression(by_c, by_knee, 0.0, 0.0, by_share)
    return force, ReboundCompression(0.0, 0.0, by_c, by_knee, by_share)


class BumpStop(NamedTuple):
    q: float
    z_max: float
    side: float


@inlined
def hydraulic_bump_stop(q, at):
    """q·(1 ± side)·max(0, |z| − z_max)·w·|w|: an orifice that closes beyond a stroke."""
    over, square = abs(at.z) - q.z_max, at.w * abs(at.w)
    if over <= 0.0:
        return Force(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), BumpStop(0.0, 0.0, 0.0)
    sgn = 1.0 if at.z > 0.0 else -1.0
    part = 1.0 + sgn * q.side
    strength = q.q * part
    force = Force(
        strength * over * square, sgn * strength * square, 2.0 * strength * over * abs(at.w), 0.0, 0.0, 0.0, 0.0
    )
    return force, BumpStop(part * over * square, -strength * square, sgn * q.q * over * square)


class Tanh(NamedTuple):
    alpha: float
    alpha_control: float
    beta: float
    delta: float
    z_r: float


@inlined
def _side(z, z_r):
    """Side of the middle with its slopes by z and z_r: the sign of z, or smooth where a hysteresis turns over z_r."""
    if z_r > 0.0:
        y = np.tanh(z / z_r)
        slope = (1.0 - y * y) / z_r
        return y, slope, -slope * z / z_r
    return (1.0 if z > 0 else (-1.0 if z < 0 else 0.0)), 0.0, 0.0


@inlined
def tanh_hysteresis(q, at):
    sz, sz_z, sz_r = _side(at.z, q.z_r)
    a = q.alpha + q.alpha_control * at.u
    th = np.tanh(q.beta * at.w + q.delta * sz)
    g = 1.0 - th * th
    force = Force(a * th, a * q.delta * sz_z * g, a * q.beta * g, q.alpha_control * th, 0.0, 0.0, 0.0)
    return force, Tanh(th, at.u * th, a * at.w * g, a * sz * g, a * q.delta * sz_r * g)


class Eddy(NamedTuple):
    f_peak: float
    w_peak: float


@inlined
def eddy_current(q, at):
    """2 f_peak r/(1 + r²), r = w/w_peak: beyond w_peak the force falls, by f_peak/(4 w_peak) at most."""
    r = at.w / q.w_peak
    m = 2.0 / (1.0 + r * r)
    by_r = q.f_peak * m * (m - 1.0)  # of r: (1 − r²)/(1 + r²) is m − 1
    return Force(q.f_peak * m * r, 0.0, by_r / q.w_peak, 0.0, 0.0, 0.0, 0.0), Eddy(m * r, -by_r * r / q.w_peak)


@inlined
def damping(code, p, o, at, dp, wanted):
    """Force of the element with that code, its parameters from p[o] on; where `wanted`, its partials from dp[o] on."""
    if code == _VISCOUS:
        force, by = viscous(Viscous(p[o], p[o + 1]), at)
        if wanted:
            dp[o], dp[o + 1] = by
    elif code == _ARCTAN:
        force, by = arctan_damping(Arctan(p[o], p[o + 1], p[o + 2], p[o + 3]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3] = by
    elif code == _PIECEWISE:
        force, by = piecewise_linear(Piecewise(p[o], p[o + 1], p[o + 2]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2] = by
    elif code == _VALVE:
        force, by = valve(Valve(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    elif code == _QUADRATIC:
        force, by = quadratic(Quadratic(p[o], p[o + 1]), at)
        if wanted:
            dp[o], dp[o + 1] = by
    elif code == _RELIEF:
        force, by = relief(Relief(p[o], p[o + 1], p[o + 2], p[o + 3]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3] = by
    elif code == ASYMMETRY:
        force, by = asymmetry(Asymmetry(p[o], p[o + 1], p[o + 2]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2] = by
    elif code == _BUMP_STOP:
        force, by = hydraulic_bump_stop(BumpStop(p[o], p[o + 1], p[o + 2]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2] = by
    elif code == _REBOUND_COMPRESSION:
        force, by = rebound_compression(ReboundCompression(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    elif code == _EDDY:
        force, by = eddy_current(Eddy(p[o], p[o + 1]), at)
        if wanted:
            dp[o], dp[o + 1] = by
    elif code == _SHIMS:
        force, by = shim_stack(Shims(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    else:
        force, by = tanh_hysteresis(Tanh(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4]), at)
        if wanted:
            dp[o], dp[o + 1], dp[o + 2], dp[o + 3], dp[o + 4] = by
    return force
