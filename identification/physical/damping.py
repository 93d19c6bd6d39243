"""Elements whose force follows from the velocity, the current and the motion at the same moment.

Each branch is one row of the catalogue: its force, the slopes by velocity and current, and the partials `dp`.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import compiled, inlined
from identification.physical.elements import Code

_VISCOUS, _ARCTAN, _PIECEWISE, _VALVE = int(Code.VISCOUS), int(Code.ARCTAN), int(Code.PIECEWISE), int(Code.VALVE)
_QUADRATIC, _RELIEF, _ASYMMETRY, _TANH = int(Code.QUADRATIC), int(Code.RELIEF), int(Code.ASYMMETRY), int(Code.TANH)
_MODULATED, _BIVISCOUS, _SIGMOID = int(Code.MODULATED_TANH), int(Code.BIVISCOUS), int(Code.SIGMOID)


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
    above = (-0.8750608600031904122785 * q2 + (-16.15753718733365076637 * q - 75.00855792314704667340)) * q2
    above += -122.8866684490136173410 * q - 64.85021904942025371773
    below = ((q + 24.85846490142306297962) * q2 + (165.0270098316988542046 * q + 432.8810604912902668951)) * q2
    below += 485.3903996359136964868 * q + 194.5506571482613964425
    angle = base + (r * (q * above / below) + r)
    return angle if x >= 0.0 else -angle


@inlined
def _turning(z, z_r):
    """Side of the middle and its slopes by z and z_r: the sign of z, or smooth where a hysteresis turns over z_r."""
    if z_r > 0.0:
        y = np.tanh(z / z_r)
        slope = (1.0 - y * y) / z_r
        return y, slope, -slope * z / z_r
    return (1.0 if z > 0 else (-1.0 if z < 0 else 0.0)), 0.0, 0.0


@inlined
def damping(code, p, o, z, w, u, dp, wanted):
    """Force and its slopes by z, w and u of a damping element; where `wanted`, its partials too."""
    f, f_z, f_w, f_u = 0.0, 0.0, 0.0, 0.0
    if code == _VISCOUS:  # (c + c_control u) w
        c = p[o] + p[o + 1] * u
        f = c * w
        f_w = c
        f_u = p[o + 1] * w
        if wanted:
            dp[o] = w
            dp[o + 1] = u * w
    elif code == _ARCTAN:  # F1 (2/π) arctan(S w) + d w; F2 stands outside the dissipative sum
        sw = p[o + 1] * w
        a = 2.0 / np.pi * arctan(sw)
        b = 2.0 / np.pi / (1.0 + sw * sw)
        f = p[o] * a + p[o + 2] * w
        f_w = p[o] * b * p[o + 1] + p[o + 2]
        if wanted:
            dp[o] = a
            dp[o + 1] = p[o] * b * w
            dp[o + 2] = w
            dp[o + 3] = 1.0
    elif code == _PIECEWISE:  # c1 w up to f_r, beyond it with slope c2
        c1, c2, fr = p[o], p[o + 1], p[o + 2]
        if abs(c1 * w) < fr:
            f = c1 * w
            f_w = c1
            if wanted:
                dp[o] = w
                dp[o + 1] = 0.0
                dp[o + 2] = 0.0
        else:
            sgn = 1.0 if w > 0 else -1.0
            f = sgn * (1.0 - c2 / c1) * fr + c2 * w
            f_w = c2
            if wanted:
                dp[o] = sgn * fr * c2 / (c1 * c1)
                dp[o + 1] = w - sgn * fr / c1
                dp[o + 2] = sgn * (1.0 - c2 / c1)
    elif code == _VALVE:  # c(u) w / sqrt(1 + (w/w_knee)²), c(u) linear and clipped
        span = p[o + 3] - p[o + 2]
        r, inside = 0.0, 0.0
        if span != 0.0:
            r = (u - p[o + 2]) / span
            inside = 1.0 if 0.0 < r < 1.0 else 0.0
            r = min(max(r, 0.0), 1.0)
        c = p[o] + (p[o + 1] - p[o]) * r
        y = w / p[o + 4]
        q = 1.0 / np.sqrt(1.0 + y * y)
        dr = (p[o + 1] - p[o]) * w * q * inside / span if span != 0.0 else 0.0
        f = c * w * q
        f_w = c * q * q * q
        f_u = dr
        if wanted:
            dp[o] = (1.0 - r) * w * q
            dp[o + 1] = r * w * q
            dp[o + 2] = -(1.0 - r) * dr
            dp[o + 3] = -r * dr
            dp[o + 4] = c * q * q * q * y * y * y
    elif code == _QUADRATIC:  # q w |w|
        f = p[o] * w * abs(w)
        f_w = 2.0 * p[o] * abs(w)
        if wanted:
            dp[o] = w * abs(w)
    elif code == _RELIEF:  # −c_drop sgn(w) max(0, |w| − w_knee)
        over = abs(w) - p[o + 1]
        if wanted:
            dp[o] = 0.0
            dp[o + 1] = 0.0
        if over > 0.0:
            sgn = 1.0 if w > 0 else -1.0
            f = -p[o] * sgn * over
            f_w = -p[o]
            if wanted:
                dp[o] = -sgn * over
                dp[o + 1] = p[o] * sgn
    elif code == _ASYMMETRY:  # c_a |w|
        f = p[o] * abs(w)
        f_w = p[o] * (1.0 if w > 0 else -1.0)
        if wanted:
            dp[o] = abs(w)
    elif code == _TANH:  # (alpha + alpha_control u) tanh(beta w + delta sgn z), or delta tanh(z / z_r)
        sz, sz_z, sz_r = _turning(z, p[o + 4])
        a = p[o] + p[o + 1] * u
        th = np.tanh(p[o + 2] * w + p[o + 3] * sz)
        g = 1.0 - th * th
        f = a * th
        f_z = a * p[o + 3] * sz_z * g
        f_w = a * p[o + 2] * g
        f_u = p[o + 1] * th
        if wanted:
            dp[o] = th
            dp[o + 1] = u * th
            dp[o + 2] = a * w * g
            dp[o + 3] = a * sz * g
            dp[o + 4] = a * p[o + 3] * sz_r * g
    return f, f_z, f_w, f_u


@compiled
def motion_damping(code, p, o, z, w, u, a, v_m, dp):
    """The same of an element that also looks at the rig's motion: its acceleration, or v_m = sqrt(v² − a x)."""
    f, f_w, f_u = 0.0, 0.0, 0.0
    if code == _MODULATED:  # (α1 u + α2)(α3 v_m² + α4 v_m + α5) tanh(β1 v_m^β2 w + (δ1 u + δ2) sgn z)
        sz = 1.0 if z > 0 else (-1.0 if z < 0 else 0.0)
        by_u, by_v = p[o] * u + p[o + 1], (p[o + 2] * v_m + p[o + 3]) * v_m + p[o + 4]
        power = v_m ** p[o + 6]
        th = np.tanh(p[o + 5] * power * w + (p[o + 7] * u + p[o + 8]) * sz)
        g = by_u * by_v * (1.0 - th * th)
        f = by_u * by_v * th
        f_w = g * p[o + 5] * power
        f_u = p[o] * by_v * th + g * p[o + 7] * sz
        dp[o] = u * by_v * th
        dp[o + 1] = by_v * th
        dp[o + 2] = by_u * v_m * v_m * th
        dp[o + 3] = by_u * v_m * th
        dp[o + 4] = by_u * th
        dp[o + 5] = g * power * w
        dp[o + 6] = g * p[o + 5] * power * w * np.log(v_m)
        dp[o + 7] = g * u * sz
        dp[o + 8] = g * sz
    elif code == _BIVISCOUS:  # c_pr (w − v_0 sgn a), held between c_po w ± (f_y + f_y_control u)
        turn = 1.0 if a > 0 else (-1.0 if a < 0 else 0.0)
        level = p[o + 2] + p[o + 3] * u
        pre, post = p[o + 1] * (w - turn * p[o + 4]), p[o] * w
        for j in range(5):
            dp[o + j] = 0.0
        if abs(pre - post) < level:
            f = pre
            f_w = p[o + 1]
            dp[o + 1] = w - turn * p[o + 4]
            dp[o + 4] = -p[o + 1] * turn
        else:
            sgn = 1.0 if pre > post else -1.0
            f = post + sgn * level
            f_w = p[o]
            f_u = sgn * p[o + 3]
            dp[o] = w
            dp[o + 2] = sgn
            dp[o + 3] = sgn * u
    elif code == _SIGMOID:  # (F_t + F_t_control u) tanh(alpha (w − h v_m sgn a)/2) (1 + k_v |w|)
        turn = 1.0 if a > 0 else (-1.0 if a < 0 else 0.0)
        level, rise = p[o] + p[o + 1] * u, 1.0 + p[o + 4] * abs(w)
        y = w - p[o + 3] * v_m * turn
        th = np.tanh(0.5 * p[o + 2] * y)
        g = 0.5 * level * rise * (1.0 - th * th)
        f = level * th * rise
        f_w = g * p[o + 2] + level * th * p[o + 4] * (1.0 if w > 0 else -1.0)
        f_u = p[o + 1] * th * rise
        dp[o] = th * rise
        dp[o + 1] = u * th * rise
        dp[o + 2] = g * y
        dp[o + 3] = -g * p[o + 2] * v_m * turn
        dp[o + 4] = level * th * abs(w)
    return f, f_w, f_u
