"""The compiled equations of the elements and the two time loops, with exact forward sensitivities.

Without a mount the core sees the rig's motion itself: z = x, w = v, and every sample is one evaluation. With a mount of
stiffness k, damping c and gap the unknown is its extension e = x − z, and each step solves

    f_core(x − e, v − de/dt) = φ(e, de/dt)

by the two-stage L-stable SDIRK2 of Alexander (1977), γ = 1 − 1/√2. Only the small extension is discretised, never the
motion itself, so that a stiff mount costs no accuracy. Dry friction is solved as the inclusion it is: first the
question whether the joint sticks, then a smooth monotone equation on the side on which it slips.

Every partial derivative stands beside its equation; sensitivities follow from the implicit function theorem on the
discrete equations, so they are the gradient of what is computed rather than of what was meant.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from identification.physical.elements import Code

_VISCOUS, _ARCTAN, _PIECEWISE, _VALVE = (
    int(Code.VISCOUS),
    int(Code.ARCTAN),
    int(Code.PIECEWISE),
    int(Code.VALVE),
)
_QUADRATIC, _RELIEF, _ASYMMETRY, _TANH = (
    int(Code.QUADRATIC),
    int(Code.RELIEF),
    int(Code.ASYMMETRY),
    int(Code.TANH),
)
_BOUC_WEN, _COULOMB, _STRIBECK, _PRESLIDING = (
    int(Code.BOUC_WEN),
    int(Code.COULOMB),
    int(Code.STRIBECK),
    int(Code.PRESLIDING),
)
_STIFFNESS, _CUBIC, _GAS, _STOP = int(Code.STIFFNESS), int(Code.CUBIC), int(Code.GAS), int(Code.STOP)
_POSITION, _FADE, _REVERSAL = int(Code.POSITION), int(Code.FADE), int(Code.REVERSAL_LAG)

_GAMMA = 1.0 - 1.0 / np.sqrt(2.0)

# Nothing in here allocates, so arrays need no reference counting; counted at every call of every element they cost more
# than the equations (measured: 90 ns a sample against 8).
_OPTIONS: Any = {"cache": True, "error_model": "numpy", "nogil": True, "_nrt": False}  # Any: _nrt has no public type
_compiled = njit(**_OPTIONS)
_inline = njit(forceinline=True, **_OPTIONS)


def workspace(elements: int, parameters: int, columns: int) -> tuple[Any, ...]:  # Any: a nest of arrays, opaque outside
    """Arrays that one run of `direct` or `mounted` works in, all zero."""
    return (
        np.zeros(elements),  # memories
        np.zeros((elements, columns)),  # their sensitivities
        np.zeros(columns),  # sensitivity of the extension
        np.zeros(6),  # e, z, w, guess of w, tolerance of w, de/dt
        (
            np.zeros(elements),
            np.zeros((elements, columns)),
            np.zeros(columns),
            np.zeros(6),
        ),  # kept for a retry
        (
            np.zeros(elements),
            np.zeros((elements, 6)),
            np.zeros(6),
            np.zeros(parameters + 1),
            np.zeros(elements),
        ),
        (np.zeros(columns), np.zeros(columns)),
    )


@_inline
def _sign(w, eps):
    """Sign of a velocity; within round-off of rest it is neither."""
    if w > eps:
        return 1.0
    if w < -eps:
        return -1.0
    return 0.0


@_compiled
def _modifiers(codes, offsets, p, z, temperature, memory, diss, dp, dm):
    """Product of the factors on the dissipative sum and its slope by z; brings `dp` and `dm` to the modified force."""
    factor, factor_z = 1.0, 0.0
    for k in range(codes.size):  # modifiers: factors on the dissipative sum
        code, o = codes[k], offsets[k]
        if code == _POSITION:  # 1 + p z²
            m = 1.0 + p[o] * z * z
            factor_z = factor_z * m + factor * 2.0 * p[o] * z
            dp[o] = z * z / m if m != 0.0 else 0.0
            factor *= m
        elif code == _FADE:  # exp(−kappa (T − T_ref))
            m = np.exp(-p[o] * (temperature - p[o + 1]))
            factor *= m
            factor_z *= m
            dp[o] = -(temperature - p[o + 1])
            dp[o + 1] = p[o]
        elif code == _REVERSAL:  # 1 − exp(−s/length), s the travel since the last reversal
            e = np.exp(-memory[k] / p[o])
            m = max(1.0 - e, 1e-12)
            factor *= m
            factor_z *= m
            dp[o] = -memory[k] / (p[o] * p[o]) * e / m
            dm[k] = e / p[o] / m
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if code in (_POSITION, _REVERSAL):
            dp[o] *= diss * factor
        elif code == _FADE:
            dp[o] *= diss * factor
            dp[o + 1] *= diss * factor
        if code == _REVERSAL:
            dm[k] *= diss * factor
        elif code in (_BOUC_WEN, _PRESLIDING):
            dm[k] *= factor
        if code <= _PRESLIDING:
            end = offsets[k + 1]
            stop = end - 1 if code == _ARCTAN else end
            for j in range(o, stop):
                dp[j] *= factor
    return factor, factor_z


@_inline
def _sliding(w, s, w_r):
    """Direction of sliding and its slopes by w and w_r: the sign `s`, or smooth where friction builds up over w_r."""
    y, y_w, y_r = s, 0.0, 0.0
    if w_r > 0.0:
        root = np.sqrt(w * w + w_r * w_r)
        y = w / root
        y_w = w_r * w_r / (root * root * root)
        y_r = -w * w_r / (root * root * root)
    return y, y_w, y_r


@_inline
def _turning(z, z_r):
    """Side of the middle and its slopes by z and z_r: the sign of z, or smooth where a hysteresis turns over z_r."""
    if z_r > 0.0:
        y = np.tanh(z / z_r)
        slope = (1.0 - y * y) / z_r
        return y, slope, -slope * z / z_r
    return (1.0 if z > 0 else (-1.0 if z < 0 else 0.0)), 0.0, 0.0


@_inline
def core_force(codes, offsets, p, z, w, s, u, temperature, memory, dp, dm, modified):
    """Force of the parallel elements and its partial derivatives.

    `s` is the sign of sliding, given apart from `w` so that a stick can be asked for; `modified` says whether any
    element is a modifier. Fills `dp` (by parameter) and `dm` (by memory slot). Returns f, ∂f/∂z, ∂f/∂w, ∂f/∂u and the
    height of the dry-friction step at w = 0.
    """
    diss, diss_z, diss_w, diss_u, jump = 0.0, 0.0, 0.0, 0.0, 0.0
    other, other_z = 0.0, 0.0
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if code == _VISCOUS:  # (c + c_control u) w
            c = p[o] + p[o + 1] * u
            diss += c * w
            diss_w += c
            diss_u += p[o + 1] * w
            dp[o] = w
            dp[o + 1] = u * w
        elif code == _ARCTAN:  # F1 (2/π) arctan(S w) + d w, and F2 outside the dissipative sum
            sw = p[o + 1] * w
            a = 2.0 / np.pi * np.arctan(sw)
            b = 2.0 / np.pi / (1.0 + sw * sw)
            diss += p[o] * a + p[o + 2] * w
            diss_w += p[o] * b * p[o + 1] + p[o + 2]
            other += p[o + 3]
            dp[o] = a
            dp[o + 1] = p[o] * b * w
            dp[o + 2] = w
            dp[o + 3] = 1.0
        elif code == _PIECEWISE:  # c1 w up to f_r, beyond it with slope c2
            c1, c2, fr = p[o], p[o + 1], p[o + 2]
            if abs(c1 * w) < fr:
                diss += c1 * w
                diss_w += c1
                dp[o] = w
                dp[o + 1] = 0.0
                dp[o + 2] = 0.0
            else:
                sgn = 1.0 if w > 0 else -1.0
                diss += sgn * (1.0 - c2 / c1) * fr + c2 * w
                diss_w += c2
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
            diss += c * w * q
            diss_w += c * q * q * q
            diss_u += dr
            dp[o] = (1.0 - r) * w * q
            dp[o + 1] = r * w * q
            dp[o + 2] = -(1.0 - r) * dr
            dp[o + 3] = -r * dr
            dp[o + 4] = c * q * q * q * y * y * y
        elif code == _QUADRATIC:  # q w |w|
            diss += p[o] * w * abs(w)
            diss_w += 2.0 * p[o] * abs(w)
            dp[o] = w * abs(w)
        elif code == _RELIEF:  # −c_drop sgn(w) max(0, |w| − w_knee)
            over = abs(w) - p[o + 1]
            dp[o] = 0.0
            dp[o + 1] = 0.0
            if over > 0.0:
                sgn = 1.0 if w > 0 else -1.0
                diss -= p[o] * sgn * over
                diss_w -= p[o]
                dp[o] = -sgn * over
                dp[o + 1] = p[o] * sgn
        elif code == _ASYMMETRY:  # c_a |w|
            diss += p[o] * abs(w)
            diss_w += p[o] * (1.0 if w > 0 else -1.0)
            dp[o] = abs(w)
        elif code == _TANH:  # (alpha + alpha_control u) tanh(beta w + delta sgn z), or delta tanh(z / z_r)
            sz, sz_z, sz_r = _turning(z, p[o + 4])
            a = p[o] + p[o + 1] * u
            th = np.tanh(p[o + 2] * w + p[o + 3] * sz)
            g = 1.0 - th * th
            diss += a * th
            diss_z += a * p[o + 3] * sz_z * g
            diss_w += a * p[o + 2] * g
            diss_u += p[o + 1] * th
            dp[o] = th
            dp[o + 1] = u * th
            dp[o + 2] = a * w * g
            dp[o + 3] = a * sz * g
            dp[o + 4] = a * p[o + 3] * sz_r * g
        elif code == _BOUC_WEN:  # alpha h
            diss += p[o] * memory[k]
            dm[k] = p[o]
            dp[o] = memory[k]
            dp[o + 1] = 0.0
            dp[o + 2] = 0.0
            dp[o + 3] = 0.0
            dp[o + 4] = 0.0
        elif code == _COULOMB:  # f_c sgn(w), or f_c w / sqrt(w² + w_r²) where it builds up over w_r
            y, y_w, y_r = _sliding(w, s, p[o + 1])
            diss += p[o] * y
            diss_w += p[o] * y_w
            jump += p[o] if p[o + 1] == 0.0 else 0.0
            dp[o] = y
            dp[o + 1] = p[o] * y_r
        elif code == _STRIBECK:  # (f_c + (f_s − f_c) exp(−(w/w_s)²)) sgn(w), the sign as in Coulomb friction
            y, y_w, y_r = _sliding(w, s, p[o + 3])
            q = w / p[o + 2]
            e = np.exp(-q * q)
            rise = p[o + 1] - p[o]
            level = p[o] + rise * e
            diss += level * y
            diss_w += level * y_w - y * rise * e * 2.0 * q / p[o + 2]
            jump += p[o + 1] if p[o + 3] == 0.0 else 0.0
            dp[o] = y * (1.0 - e)
            dp[o + 1] = y * e
            dp[o + 2] = y * rise * e * 2.0 * q * q / p[o + 2]
            dp[o + 3] = level * y_r
        elif code == _PRESLIDING:  # its force is its memory
            diss += memory[k]
            dm[k] = 1.0
            dp[o] = 0.0
            dp[o + 1] = 0.0
        elif code == _STIFFNESS:  # k z
            other += p[o] * z
            other_z += p[o]
            dp[o] = z
        elif code == _CUBIC:  # k3 z³
            other += p[o] * z * z * z
            other_z += 3.0 * p[o] * z * z
            dp[o] = z * z * z
        elif code == _GAS:  # −f0 (1 + z/length)^(−n)
            b = max(1.0 + z / p[o + 1], 0.02)
            q = b ** (-p[o + 2])
            other -= p[o] * q
            slope = p[o] * p[o + 2] * q / b
            other_z += slope / p[o + 1]
            dp[o] = -q
            dp[o + 1] = -slope * z / (p[o + 1] * p[o + 1])
            dp[o + 2] = p[o] * q * np.log(b)
        elif code == _STOP:  # k max(0, z − z_max) − k max(0, −z_max − z)
            dp[o] = 0.0
            dp[o + 1] = 0.0
            if abs(z) > p[o + 1]:
                sgn = 1.0 if z > 0 else -1.0
                other += p[o] * (z - sgn * p[o + 1])
                other_z += p[o]
                dp[o] = z - sgn * p[o + 1]
                dp[o + 1] = -sgn * p[o]
    factor, factor_z = 1.0, 0.0
    if modified:
        factor, factor_z = _modifiers(codes, offsets, p, z, temperature, memory, diss, dp, dm)
    f_z = diss_z * factor + diss * factor_z + other_z
    return diss * factor + other, f_z, diss_w * factor, diss_u * factor, jump * factor


@_compiled
def _bouc_wen(p, o, h, travel, s, out):
    """Internal displacement after a monotone leg; `out` gets ∂/∂h, ∂/∂z and the partials by A, n, beta, gamma.

    dh/dt = A w − gamma |w| h |h|^(n−1) − beta w |h|^n does not depend on time but on travel: along it
    dh/dζ = s A − gamma h |h|^(n−1) − s beta |h|^n. Exponential Rosenbrock–Euler, exact for n = 1 and
    stable for any travel.
    """
    a, n, beta, gamma = p[o + 1], p[o + 2], p[o + 3], p[o + 4]
    scale = (a / max(abs(beta + gamma), 1e-300)) ** (1.0 / n)
    steps = min(1 + int(4.0 * travel * a * n / max(scale, 1e-300)), 24)
    d = travel / steps
    dh, da, dn, db, dg = 1.0, 0.0, 0.0, 0.0, 0.0
    g = 0.0
    for _ in range(steps):
        m = abs(h) ** (n - 1.0)
        sgn = 1.0 if h > 0 else (-1.0 if h < 0 else 0.0)
        log = np.log(abs(h)) if h != 0.0 else 0.0
        g = s * a - gamma * h * m - s * beta * abs(h) * m
        j = -n * m * (gamma + s * sgn * beta)
        y = j * d
        phi = 1.0 + 0.5 * y if abs(y) < 1e-5 else np.expm1(min(y, 50.0)) / y
        e = np.exp(min(y, 50.0))
        step = d * phi
        gn = -(gamma * h * m + s * beta * abs(h) * m) * log
        da = e * da + step * s
        dn = e * dn + step * gn
        db = e * db - step * s * abs(h) * m
        dg = e * dg - step * h * m
        dh *= e
        h = min(max(h + step * g, -1e3 * scale), 1e3 * scale)
    m = abs(h) ** (n - 1.0)
    out[0] = dh
    out[1] = s * (s * a - gamma * h * m - s * beta * abs(h) * m)
    out[2], out[3], out[4], out[5] = da, dn, db, dg
    return h


@_compiled
def _presliding(p, o, f, travel, s, out):
    """Friction force after a monotone leg, exact: s f_c + (f − s f_c) exp(−sigma travel / f_c); partials as above."""
    sigma, fc = p[o], p[o + 1]
    e = np.exp(-sigma * travel / fc)
    new = s * fc + (f - s * fc) * e
    out[0] = e
    out[1] = sigma * (1.0 - s * new / fc)
    out[2] = -(f - s * fc) * e * travel / fc
    out[3] = s * (1.0 - e) + (f - s * fc) * e * sigma * travel / (fc * fc)
    out[4], out[5] = 0.0, 0.0
    return new


@_compiled
def _leg(code, p, o, m, travel, s, out):
    return _bouc_wen(p, o, m, travel, s, out) if code == _BOUC_WEN else _presliding(p, o, m, travel, s, out)


@_compiled
def _travel(m, dz, w_old, w, h, out):
    """Travel since the last reversal after a step of dz; `out` as in `_bouc_wen`."""
    out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
    out[0], out[1] = 0.0, (1.0 if w > 0 else -1.0)
    new = 0.0
    if w_old * w < 0.0:  # reversed within the step: uniform deceleration through rest
        new = 0.5 * h * w * w / (abs(w) + abs(w_old))
    elif w == 0.0:
        out[1] = 0.0
    elif w_old == 0.0 and m == 0.0:
        new = abs(dz)
    else:
        out[0] = 1.0
        new = m + abs(dz)
    return new


@_compiled
def _advance(code, p, o, m, z_old, z, w_old, w, h, out, tmp):
    """Memory of one element after a step; `out` as in `_bouc_wen`. A reversal inside the step splits it in two legs."""
    new, dz = 0.0, z - z_old
    if code == _REVERSAL:
        new = _travel(m, dz, w_old, w, h, out)
    elif w_old * w < 0.0:
        part = abs(w) / (abs(w) + abs(w_old))
        first, second = 0.5 * h * (1.0 - part) * abs(w_old), 0.5 * h * part * abs(w)
        middle = _leg(code, p, o, m, first, 1.0 if w_old > 0 else -1.0, tmp)
        new = _leg(code, p, o, middle, second, 1.0 if w > 0 else -1.0, out)
        for j in range(2, 6):
            out[j] += out[0] * tmp[j]
        out[0] *= tmp[0]
    else:
        new = _leg(code, p, o, m, abs(dz), 1.0 if dz >= 0 else -1.0, out)
    return new


@_inline
def _is_memory(code):
    return code in (_BOUC_WEN, _PRESLIDING, _REVERSAL)


@_compiled
def _has_modifier(codes):
    found = False
    for code in codes:
        found = found or code in (_POSITION, _FADE, _REVERSAL)
    return found


@_compiled
def _steady(codes, offsets, p, w, memory):
    """Every internal force at its steady value for the velocity `w`."""
    s = 1.0 if w > 0 else (-1.0 if w < 0 else 0.0)
    for k in range(codes.size):
        o = offsets[k]
        if codes[k] == _BOUC_WEN:
            total = max(p[o + 3] + p[o + 4], 1e-300)
            memory[k] = s * (p[o + 1] / total) ** (1.0 / p[o + 2])
        elif codes[k] == _PRESLIDING:
            memory[k] = s * p[o + 1]
        elif codes[k] == _REVERSAL:
            memory[k] = 1e300
        else:
            memory[k] = 0.0


@_inline
def _own(code, o):
    """First parameter that the partials out[2:6] of a memory belong to."""
    return o + 1 if code == _BOUC_WEN else o


@_inline
def _own_count(code):
    if code == _BOUC_WEN:
        return 4
    return 2 if code == _PRESLIDING else 0


@_compiled
def direct(codes, offsets, p, column, dt, x, v, u, du, temperature, eps, force, jac, space):
    """Core force along a motion without a mount.

    column : (P,) int64, the column of `jac` of each core parameter, −1 where none is wanted
    du : (C, N) float64, sensitivities of u by the first C columns of `jac`
    force : (N,) float64, N; jac : (N, M) float64 or (0, M) when no gradient is wanted. Both are filled.
    space : a fresh `workspace`
    """
    n_el = codes.size
    memory, sens, out = space[0], space[1], space[3]
    _, _, tmp, dp, dm = space[5]
    wanted = jac.shape[0] > 0
    modified = _has_modifier(codes)
    _steady(codes, offsets, p, v[0], memory)
    for i in range(x.size):
        z, w = x[i], v[i]
        s = _sign(w, eps)
        if i > 0:
            for k in range(n_el):
                code = codes[k]
                if _is_memory(code):
                    memory[k] = _advance(code, p, offsets[k], memory[k], x[i - 1], z, v[i - 1], w, dt, out, tmp)
                    if wanted:
                        first = _own(code, offsets[k])
                        for j in range(sens.shape[1]):
                            sens[k, j] *= out[0]
                        for j in range(_own_count(code)):
                            if column[first + j] >= 0:
                                sens[k, column[first + j]] += out[2 + j]
        f, _, _, f_u, _ = core_force(codes, offsets, p, z, w, s, u[i], temperature[i], memory, dp, dm, modified)
        force[i] = f
        if wanted:
            for j in range(p.size):
                if column[j] >= 0:
                    jac[i, column[j]] = dp[j]
            for j in range(du.shape[0]):
                jac[i, j] += f_u * du[j, i]
            for k in range(n_el):
                if _is_memory(codes[k]):
                    for j in range(sens.shape[1]):
                        jac[i, j] += dm[k] * sens[k, j]


@_inline
def _copy(to, source):
    """Element by element: slice assignment costs more than a step of the solver."""
    for j in range(to.size):
        to[j] = source[j]


@_compiled
def _keep(memory, sens, de, state, to_memory, to_sens, to_de, to_state):
    _copy(to_memory, memory)
    for k in range(sens.shape[0]):
        for j in range(sens.shape[1]):
            to_sens[k, j] = sens[k, j]
    _copy(to_de, de)
    _copy(to_state, state)


@_inline
def _contact(k, c, gap, e, rate):
    """Force of the mount and its partials by e, de/dt, k, c, gap: a spring and damper beyond half the gap."""
    if gap == 0.0:
        return k * e + c * rate, k, c, e, rate, 0.0
    if abs(e) <= 0.5 * gap:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    s = 1.0 if e > 0 else -1.0
    d = e - s * 0.5 * gap
    f = k * d + c * rate
    if f * s <= 0.0:  # a contact can push and be pushed, not stick
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return f, k, c, d, rate, -0.5 * k * s


@_inline
def _trial(program, z, w, s, h, u, temperature, state, memory, work):
    """Core force at a trial state, memories carried there from the last step; adds their share to ∂f/∂z."""
    codes, offsets, p, modified, remembers = program[0], program[1], program[2], program[4], program[5]
    trial, parts, tmp, dp, dm = work
    if remembers:
        for k in range(codes.size):
            if _is_memory(codes[k]):
                trial[k] = _advance(codes[k], p, offsets[k], memory[k], state[1], z, state[2], w, h, parts[k], tmp)
    f, f_z, f_w, f_u, jump = core_force(codes, offsets, p, z, w, s, u, temperature, trial, dp, dm, modified)
    if remembers:
        for k in range(codes.size):
            if _is_memory(codes[k]):
                f_z += dm[k] * parts[k, 1]
    return f, f_z, f_w, f_u, jump


@_inline
def _solve(program, mount, x, v, u, temperature, e0, gh, h, state, memory, work):
    """Velocity of the core at one implicit stage.

    Returns w, ∂f/∂z + ∂φ/∂e, ∂f/∂u, the slope of the equation by w, and whether it converged; a slope of 0 means stick.
    """
    km, cm, gap = mount[0], mount[1], mount[2]
    guess, tol = state[3], state[4]
    low, high, side = -np.inf, np.inf, 0.0
    w, stiff, f_u, slope, done, ready = guess, 0.0, 0.0, 0.0, False, False
    if program[6]:  # dry friction: does it hold the core at rest?
        f, _, _, f_u, jump = _trial(program, x - e0 - gh * v, 0.0, 0.0, h, u, temperature, state, memory, work)
        phi, _, _, _, _, _ = _contact(km, cm, gap, e0 + gh * v, v)
        side = -1.0 if f > phi else 1.0
        done = abs(f - phi) <= jump
        if side > 0:
            low = 0.0
        else:
            high = 0.0
        if done:
            w = 0.0
        elif guess * side <= 0.0:
            w = side * 1e-3 * abs(v)
    iterations = 0
    while not done and iterations < 80:
        iterations += 1
        rate = v - w
        s = side if side != 0.0 else (1.0 if w > 0 else -1.0)
        f, f_z, f_w, f_u, _ = _trial(program, x - e0 - gh * rate, w, s, h, u, temperature, state, memory, work)
        phi, phi_e, phi_r, _, _, _ = _contact(km, cm, gap, e0 + gh * rate, rate)
        residual = f - phi
        stiff = f_z + phi_e
        slope = f_w + gh * stiff + phi_r
        if ready or residual == 0.0:
            done = True
        else:
            if residual < 0.0:
                low = w
            else:
                high = w
            new = w - residual / slope if slope > 0.0 else np.nan
            if not (low < new < high):
                if np.isfinite(low) and np.isfinite(high):
                    new = 0.5 * (low + high)
                else:
                    new = w - np.sign(residual) * max(2.0 * abs(w), 1e3 * tol)
            # Newton squares its error: what is within 1e-7 now is at round-off after the evaluation that follows.
            ready = abs(new - w) <= 1e-7 * abs(w) + tol or new == w
            w = new
        slope = max(slope, 1e-300)
    return w, stiff, f_u, slope, done


@_compiled
def _rate_sensitivity(program, mount, mount_column, e, rate, stiff, f_u, slope, de, de_base, du, i, q, sens, work, out):
    """∂(de/dt)/∂θ of one stage by the implicit function theorem; zero where the core sticks."""
    inverse = 1.0 / slope if slope > 0.0 else 0.0
    codes, offsets, p, column = program[0], program[1], program[2], program[3]
    parts, dp, dm = work[1], work[3], work[4]
    for j in range(out.size):
        out[j] = -stiff * de_base[j]
    for j in range(p.size):
        if column[j] >= 0:
            out[column[j]] += dp[j]
    for j in range(du.shape[0]):
        out[j] += f_u * (du[j, i] + q * (du[j, i + 1] - du[j, i]))
    if program[5]:
        for k in range(codes.size):
            if _is_memory(codes[k]):
                first = _own(codes[k], offsets[k])
                for j in range(out.size):  # the leg began at z_old, which moved by −de
                    out[j] += dm[k] * (parts[k, 0] * sens[k, j] + parts[k, 1] * de[j])
                for j in range(_own_count(codes[k])):
                    if column[first + j] >= 0:
                        out[column[first + j]] += dm[k] * parts[k, 2 + j]
    _, _, _, by_k, by_c, by_gap = _contact(mount[0], mount[1], mount[2], e, rate)
    if mount_column[0] >= 0:
        out[mount_column[0]] -= by_k
    if mount_column[1] >= 0:
        out[mount_column[1]] -= by_c
    if mount_column[2] >= 0:
        out[mount_column[2]] -= by_gap
    for j in range(out.size):
        out[j] *= inverse


@_compiled
def _step(program, mount, mount_column, motion, i, sub, substeps, state, memory, du, sens, de, work, grads, wanted):
    """One SDIRK2 step from (sub)/substeps to (sub + 1)/substeps of sample interval i; returns whether it converged.

    state : e, z and w at the last step, the guess of w, the tolerance of w, and de/dt at the end.
    """
    x, v, u, temperature, dt = motion
    de_base, rate_sens = grads
    h = dt / substeps
    gh = _GAMMA * h
    dx = x[i + 1] - x[i]
    e0, e, rate, z, w, converged = state[0], 0.0, 0.0, 0.0, 0.0, True
    _copy(de_base, de)
    for stage in range(2):
        part = _GAMMA if stage == 0 else 1.0
        q = (sub + part) / substeps
        q2, q3 = q * q, q * q * q  # cubic Hermite: exact at samples, fourth order between them
        xs = x[i] + (3 * q2 - 2 * q3) * dx + dt * ((q3 - 2 * q2 + q) * v[i] + (q3 - q2) * v[i + 1])
        vs = 6 * (q - q2) * dx / dt + (3 * q2 - 4 * q + 1) * v[i] + (3 * q2 - 2 * q) * v[i + 1]
        us = u[i] + q * (u[i + 1] - u[i])
        ts = temperature[i] + q * (temperature[i + 1] - temperature[i])
        w, stiff, f_u, slope, ok = _solve(program, mount, xs, vs, us, ts, e0, gh, h * part, state, memory, work)
        converged = converged and ok
        rate = vs - w
        e = e0 + gh * rate
        if wanted:
            _rate_sensitivity(
                program, mount, mount_column, e, rate, stiff, f_u, slope, de, de_base, du, i, q, sens, work, rate_sens
            )  # fmt: skip
        if stage == 0:
            e0 += (1.0 - _GAMMA) * h * rate
            for j in range(de.size if wanted else 0):
                de_base[j] += (1.0 - _GAMMA) * h * rate_sens[j]
        z = xs - e
        state[3] = w
    if wanted:
        for j in range(de.size):
            de_base[j] += gh * rate_sens[j]
        _carry(program, sens, de, de_base, work[1])
        _copy(de, de_base)
    if program[5]:
        _copy(memory, work[0])
    state[0], state[1], state[2], state[5] = e, z, w, rate
    return converged


@_compiled
def _carry(program, sens, de, de_new, parts):
    """Sensitivities of the memories after a step in which the core moved by the change of −e."""
    codes, offsets, column = program[0], program[1], program[3]
    for k in range(codes.size):
        if _is_memory(codes[k]):
            first = _own(codes[k], offsets[k])
            for j in range(de.size):
                sens[k, j] = parts[k, 0] * sens[k, j] + parts[k, 1] * (de[j] - de_new[j])
            for j in range(_own_count(codes[k])):
                if column[first + j] >= 0:
                    sens[k, column[first + j]] += parts[k, 2 + j]


@_compiled
def mounted(
    codes,
    offsets,
    p,
    column,
    dt,
    x,
    v,
    u,
    du,
    temperature,
    eps,
    mount,
    mount_column,
    substeps,
    fine,
    force,
    jac,
    space,
):
    """Force through a series mount: arguments as in `direct`.

    mount : (3,) float64, k in N/m, c in N·s/m, gap in m; mount_column : (3,) their columns of `jac`.
    substeps : steps to a sample; `fine` of them where a contact opens or closes or a memory meets a reversal.
    Returns the number of steps whose equation did not converge.
    """
    n_col = jac.shape[1]
    wanted = jac.shape[0] > 0
    has_jump, remembers = False, False
    for code in codes:
        has_jump = has_jump or code in (_COULOMB, _STRIBECK)
        remembers = remembers or _is_memory(code)
    program = (codes, offsets, p, column, _has_modifier(codes), remembers, has_jump)
    motion = (x, v, u, temperature, dt)
    memory, sens, de, state, kept, work, grads = space
    top = 1e-300
    for i in range(v.size):
        top = max(top, abs(v[i]))
    state[1], state[2], state[3], state[4] = x[0], v[0], v[0], 1e-13 * top
    failures = 0
    _steady(codes, offsets, p, v[0], memory)
    for i in range(x.size - 1):
        touching = abs(state[0]) > 0.5 * mount[2]
        if fine > substeps:
            _keep(memory, sens, de, state, kept[0], kept[1], kept[2], kept[3])
        for sub in range(substeps):
            if not _step(program, mount, mount_column, motion, i, sub, substeps, state, memory, du, sens, de, work,
                         grads, wanted):  # fmt: skip
                failures += 1
        impact = (abs(state[0]) > 0.5 * mount[2]) != touching
        turned = remembers and kept[3][2] * state[2] < 0.0
        if fine > substeps and (impact or turned):
            _keep(kept[0], kept[1], kept[2], kept[3], memory, sens, de, state)
            for sub in range(fine):
                if not _step(program, mount, mount_column, motion, i, sub, fine, state, memory, du, sens, de, work,
                             grads, wanted):  # fmt: skip
                    failures += 1
        phi, phi_e, phi_r, by_k, by_c, by_gap = _contact(mount[0], mount[1], mount[2], state[0], state[5])
        force[i + 1] = phi
        if wanted:
            for j in range(n_col):
                jac[i + 1, j] = phi_e * de[j] + phi_r * grads[1][j]
            if mount_column[0] >= 0:
                jac[i + 1, mount_column[0]] += by_k
            if mount_column[1] >= 0:
                jac[i + 1, mount_column[1]] += by_c
            if mount_column[2] >= 0:
                jac[i + 1, mount_column[2]] += by_gap
    # The first sample is a convention (no extension, no history): its neighbour stands for it.
    force[0] = force[1]
    for j in range(n_col if wanted else 0):
        jac[0, j] = jac[1, j]
    return failures
