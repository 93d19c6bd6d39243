"""How the memories of elements change over a step: hysteresis, presliding, bristles, the travel since a reversal, a
velocity or a position that is followed late."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined
from identification.physical.elements.catalogue import code_of
from identification.physical.elements.equations.friction import BoucWen
from identification.physical.elements.equations.motion import LuGre, bristle_level
from identification.physical.elements.equations.springs import gas_of, tended_to

_BOUC_WEN, _PRESLIDING = code_of("bouc_wen"), code_of("presliding_friction")
_REVERSAL, _LUGRE = code_of("reversal_force_lag"), code_of("lugre_friction")
_SELECTIVE, _GAS = code_of("frequency_selective_damping"), code_of("gas_spring")
_PART = 0.5  # of the travel in which a Bouc–Wen hysteresis fades by e: one Runge–Kutta step
_FORGOTTEN = 16  # such steps on, what was has faded by e⁻⁸
_GROWN = 64  # such steps on, what grows as it is loaded is at its top: e⁷ times as high as it began to grow

BY_MEMORY, BY_Z, OWN, BY_W, BY_W_OLD, BY_START, PARTIALS = 0, 1, 2, 7, 8, 9, 10
"""Places of the partials of a memory after a step: by z is −that by z at its start, less `BY_START` of a few."""


class Leg(NamedTuple):
    """A step of the core as its memories see it: displacement, velocity at both ends, duration, place."""

    dz: float
    w_old: float
    w: float
    h: float
    z: float  # at the end


@inlined
def bouc_wen_of(p, o):
    """The parameters of a Bouc–Wen hysteresis by name."""
    return BoucWen(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4], p[o + 5])


@inlined
def _lugre_of(p, o):
    return LuGre(p[o], p[o + 1], p[o + 2], p[o + 3], p[o + 4])


@inlined
def own(code, o):
    """First parameter that the partials out[2:] of a memory belong to."""
    return o + 1 if code in (_BOUC_WEN, _SELECTIVE, _GAS) else o


@inlined
def own_count(code):
    """How many parameters those are."""
    if code == _BOUC_WEN:
        return 4
    if code == _LUGRE:
        return 5
    if code == _SELECTIVE:
        return 1
    if code == _GAS:
        return 3
    return 2 if code == _PRESLIDING else 0


@inlined
def bouc_wen_leg(q, n, h, travel, s, wanted, out):
    """Internal displacement after a monotone leg; `out` gets ∂/∂h, ∂/∂z, where `wanted` those by A, n, beta, gamma.

    dh/dt = A w − gamma |w| h |h|^(n−1) − beta w |h|^n does not depend on time but on travel ζ: along it
    dh/dζ = g(h) = s A − h |h|^(n−1) (gamma + s sgn(h) beta), by the classical Runge–Kutta method of fourth order. What
    lies `_FORGOTTEN` steps back has faded by e^−8: a longer leg ends saturated, or at the top of what grows. The
    partials are those of these very steps: `l1` … `l4` say what h owes to the slope at each stage.
    """
    a, beta, gamma = s * q.A, s * q.beta, q.gamma
    far = fading(q, n)
    count, top = travel / (_PART * far), 1e3 * far * n * q.A
    if count > _FORGOTTEN and q.beta + gamma > 0.0:
        out[0], out[1] = 0.0, 0.0
        end, out[2], out[3], out[4] = _saturated(q, n, s)
        out[5] = out[4]
        return end
    if count > _GROWN:
        out[0], out[1], out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        return s * top
    steps = 1 + int(count)
    d = travel / steps
    dh, dz, da, dn, db, dg = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(steps):
        g1, y1, e1 = _along(h, a, n, beta, gamma)
        h2 = _within(h + 0.5 * d * g1, top)
        g2, y2, e2 = _along(h2, a, n, beta, gamma)
        h3 = _within(h + 0.5 * d * g2, top)
        g3, y3, e3 = _along(h3, a, n, beta, gamma)
        h4 = _within(h + d * g3, top)
        g4, y4, e4 = _along(h4, a, n, beta, gamma)
        mean = (g1 + 2.0 * (g2 + g3) + g4) / 6.0
        l4 = d / 6.0
        l3 = d / 3.0 + d * y4 * l4
        l2 = d / 3.0 + 0.5 * d * y3 * l3
        l1 = d / 6.0 + 0.5 * d * y2 * l2
        by_h = 1.0 + l1 * y1 + l2 * y2 + l3 * y3 + l4 * y4
        dz = by_h * dz + (mean + 0.5 * (g1 * y2 * l2 + g2 * y3 * l3) + g3 * y4 * l4) / steps
        if wanted:
            da = by_h * da + s * (l1 + l2 + l3 + l4)
            db = by_h * db - s * (l1 * abs(e1) + l2 * abs(e2) + l3 * abs(e3) + l4 * abs(e4))
            dg = by_h * dg - (l1 * e1 + l2 * e2 + l3 * e3 + l4 * e4)
            dn = by_h * dn + l1 * (g1 - a) * _log(h) + l2 * (g2 - a) * _log(h2)
            dn += l3 * (g3 - a) * _log(h3) + l4 * (g4 - a) * _log(h4)
        dh *= by_h
        h = _within(h + d * mean, top)
    out[0] = dh
    out[1] = s * dz
    out[2], out[3], out[4], out[5] = da, dn, db, dg
    return h


@inlined
def fading(q, n):
    """The travel, m, in which a saturated Bouc–Wen hysteresis forgets all but the e-th part: its height over n A."""
    return max((q.A / max(abs(q.beta + q.gamma), 1e-300)) ** (1.0 / n), 1e-300) / (n * q.A)


@inlined
def _saturated(q, n, s):
    """Where Bouc–Wen hysteresis ends on a long way, s (A/(beta + gamma))^(1/n), its slopes by A, n, beta or gamma."""
    total = max(q.beta + q.gamma, 1e-300)
    ratio = q.A / total
    h = s * ratio ** (1.0 / n)
    return h, h / (n * q.A), -h * np.log(ratio) / (n * n), -h / (n * total)


@inlined
def _along(h, a, n, beta, gamma):
    """dh/dζ, its slope by h, and h |h|^(n−1); `a` and `beta` carry the direction of travel."""
    m = abs(h) ** (n - 1.0)
    pull = gamma + beta if h > 0.0 else gamma - beta
    return a - h * m * pull, -n * m * pull, h * m


@inlined
def _within(h, top):
    """What bounds a model that would run away."""
    return min(max(h, -top), top)


@inlined
def _log(h):
    return np.log(max(abs(h), 1e-300))


STANDS = 0.01
"""Share of the highest speed below which a machine stands: the noise of a slow record is as high. Half: some noise of
coarse encoders is motion; double: a start near a turn of a sine is rest, which is forgotten within a stroke."""

SLIDERS = 8
"""Sliders of a presliding friction whose loops close: half as many make steps of its stiffness of twice the height."""
_GIVES_WAY = -np.log(1.0 - (np.arange(SLIDERS) + 0.5) / SLIDERS)
_SHARES = _GIVES_WAY / np.sum(_GIVES_WAY)  # of f_c that each holds: of an even stiffness, the force builds up by e^−x


@inlined
def _slider_leg(sigma, fc, share, f, travel, s, out):
    """Force of one slider of the stiffness sigma/`SLIDERS` after a monotone leg, at most `share` of f_c; partials as
    above. All together are a Masing model (1926; Iwan 1966)."""
    out[0], out[1], out[2], out[3] = 1.0, sigma / SLIDERS, s * travel / SLIDERS, 0.0
    new, most = f + s * travel * sigma / SLIDERS, share * fc
    if s * new >= most:
        out[0], out[1], out[2], out[3] = 0.0, 0.0, 0.0, s * share
        new = s * most
    return new


@compiled
def _presliding_leg(sigma, fc, f, travel, s, out):
    """Friction force after a monotone leg, exact: s f_c + (f − s f_c) exp(−sigma travel / f_c); partials as above."""
    e = np.exp(-sigma * travel / fc)
    new = s * fc + (f - s * fc) * e
    out[0] = e
    out[1] = sigma * (1.0 - s * new / fc)
    out[2] = -(f - s * fc) * e * travel / fc
    out[3] = s * (1.0 - e) + (f - s * fc) * e * sigma * travel / (fc * fc)
    return new


@compiled
def _bristle_leg(q, m, travel, s, h, out):
    """Deflection of the LuGre bristle after a monotone leg of duration h, exact at the mean speed of the leg.

    dm/dt = w − sigma0 |w| m/g(w) gives m = s g/sigma0 + (m0 − s g/sigma0) exp(−sigma0 travel/g). `out` gets ∂/∂m0, ∂/∂z
    and the partials by sigma0, sigma1, f_c, f_s, w_s.
    """
    # A leg to a reversal at once: its duration rounds to zero, and it changes nothing.
    sigma, rate = q.sigma0, 1.0 / h if h > 0.0 else 0.0
    speed = travel * rate
    g, g_w, e = bristle_level(q, speed)
    end = s * g / sigma
    fade = np.exp(-sigma * travel / g)
    by_g = s / sigma * (1.0 - fade) + (m - end) * fade * sigma * travel / (g * g)
    x = speed / q.w_s
    out[0] = fade
    out[1] = s * (by_g * g_w * rate - (m - end) * sigma / g * fade)
    out[2] = -end / sigma * (1.0 - fade) - (m - end) * travel / g * fade
    out[3] = 0.0
    out[4] = by_g * (1.0 - e)
    out[5] = by_g * e
    out[6] = by_g * (q.f_s - q.f_c) * e * 2.0 * x * x / q.w_s
    return end + (m - end) * fade


@compiled
def _leg(code, p, o, m, path, wanted, out):
    """Memory after a monotone leg; `path` is its travel, its direction and its duration."""
    travel, s, h = path
    new = 0.0
    if code == _BOUC_WEN:
        q = bouc_wen_of(p, o)
        if q.n == 2.0:  # the exponent that most papers take: a constant leaves no power
            new = bouc_wen_leg(q, 2.0, m, travel, s, wanted, out)
        else:
            new = bouc_wen_leg(q, q.n, m, travel, s, wanted, out)
    elif code == _PRESLIDING and p[o + 3] > 0.0:
        new = _slider_leg(p[o], p[o + 1], _SHARES[int(p[o + 3]) - 1], m, travel, s, out)
    elif code == _PRESLIDING:
        new = _presliding_leg(p[o], p[o + 1], m, travel, s, out)
    else:
        new = _bristle_leg(_lugre_of(p, o), m, travel, s, h, out)
    return new


@compiled
def _travel(m, leg, out):
    """Travel since the last reversal after a step; `out` as in `advance`."""
    dz, w_old, w, h, _ = leg
    out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
    out[BY_MEMORY], out[BY_Z], out[BY_W], out[BY_W_OLD] = 0.0, (1.0 if w > 0 else -1.0), 0.0, 0.0
    new = 0.0
    if w_old * w < 0.0:  # reversed within the step: uniform deceleration through rest
        a, b = abs(w_old), abs(w)
        new = 0.5 * h * b * b / (a + b)
        out[BY_Z] = 0.0
        out[BY_W] = np.sign(w) * 0.5 * h * b * (b + 2.0 * a) / (a + b) ** 2
        out[BY_W_OLD] = -np.sign(w_old) * 0.5 * h * b * b / (a + b) ** 2
    elif w == 0.0:
        out[BY_Z] = 0.0
    elif w_old == 0.0 and m == 0.0:
        new = abs(dz)
    else:
        out[BY_MEMORY] = 1.0
        new = m + abs(dz)
    return new


@compiled
def _followed(tau, m, leg, out):
    """y after a step of dy/dt = (w − y)/tau, exact for a velocity that is linear over it; `out` as in `advance`.

    With s = h/tau: y = e^−s y0 + (1 − e^−s) w_old + (1 − (1 − e^−s)/s) (w − w_old).
    """
    _, w_old, w, h, _ = leg
    s = max(h / tau, 1e-300)
    e, gone = np.exp(-s), -np.expm1(-s)
    ramp = 1.0 - gone / s
    out[BY_MEMORY], out[BY_Z], out[BY_W], out[BY_W_OLD] = e, 0.0, ramp, gone - ramp
    out[OWN] = (s * e * (m - w_old) - (gone / s - e) * (w - w_old)) / tau
    return e * m + gone * w_old + ramp * (w - w_old)


@compiled
def _behind(q, m, leg, out):
    """y of a gas less what it tends to, r, after a step: r = e^−s r0 − (1 − e^−s)/s·Δr∞, s = heat h; `out` as in
    `advance`.

    Exact where what it tends to changes evenly over the step.
    """
    s = max(leg.h * q.heat, 1e-300)
    e, mean = np.exp(-s), -np.expm1(-s) / s
    old, new = tended_to(q, leg.z - leg.dz), tended_to(q, leg.z)
    rise = new.y - old.y
    out[BY_MEMORY], out[BY_Z], out[BY_W], out[BY_W_OLD] = e, -mean * new.by_z, 0.0, 0.0
    out[BY_START] = mean * (old.by_z - new.by_z)
    out[OWN], out[OWN + 1] = -mean * (new.by_length - old.by_length), -mean * (new.by_n - old.by_n)
    out[OWN + 2] = -(s * e * m + (e - mean) * rise) / q.heat
    return e * m - mean * rise


@compiled
def advance(code, p, o, m, leg, wanted, out, tmp):
    """Memory of one element after a step. A reversal inside the step splits it in two legs, by uniform deceleration.

    `out` gets the partials by the memory before, by z, by the parameters of its own, and by the speeds at both ends.
    """
    new = 0.0
    dz, w_old, w, h, _ = leg
    if code == _REVERSAL:
        new = _travel(m, leg, out)
    elif code == _SELECTIVE:
        new = _followed(p[o + 1], m, leg, out)
    elif code == _GAS:
        new = _behind(gas_of(p, o), m, leg, out)
    elif w_old * w < 0.0:
        a, b = abs(w_old), abs(w)
        part, turn = b / (a + b), np.sign(w)
        first, second = 0.5 * h * (1.0 - part) * a, 0.5 * h * part * b
        middle = _leg(code, p, o, m, (first, -turn, h * (1.0 - part)), wanted, tmp)
        new = _leg(code, p, o, middle, (second, turn, h * part), wanted, out)
        for j in range(OWN, OWN + own_count(code)):
            out[j] += out[BY_MEMORY] * tmp[j]
        by_first, by_second, scale = -turn * tmp[BY_Z] * out[BY_MEMORY], turn * out[BY_Z], 0.5 * h / (a + b) ** 2
        out[BY_W] = turn * scale * (by_second * b * (b + 2.0 * a) - by_first * a * a)
        out[BY_W_OLD] = -turn * scale * (by_first * a * (a + 2.0 * b) - by_second * b * b)
        out[BY_MEMORY] *= tmp[BY_MEMORY]
        out[BY_Z] = 0.0
    else:
        new = _leg(code, p, o, m, (abs(dz), 1.0 if dz >= 0 else -1.0, h), wanted, out)
        out[BY_W], out[BY_W_OLD] = 0.0, 0.0
    return new


@compiled
def steady(core, v, x, memory, sens):
    """Every internal force at its steady value for the first velocity of `v`, with its sensitivities where these are
    wanted. Who stands still has that of rest: the sign of what is left of a velocity tells of no motion before.

    What does not saturate within half the stroke of `x` begins as an elastic spring would after that travel. A gas
    that takes up heat begins as if it had long moved as it does along `x`, or out of rest.
    """
    codes, offsets, p, column = core.codes, core.offsets, core.p, core.column
    reach = _half_stroke(x)
    w = v[0] if abs(v[0]) > STANDS * highest(v) else 0.0
    s = 1.0 if w > 0 else (-1.0 if w < 0 else 0.0)
    for k in range(codes.size):
        o = offsets[k]
        memory[k] = 0.0
        if codes[k] == _BOUC_WEN:
            q = bouc_wen_of(p, o)
            memory[k], by_a, by_n, by_loss = _saturated(q, q.n, s)
            if abs(memory[k]) > reach * q.A:
                memory[k] = s * reach * q.A
                by_a, by_n, by_loss = s * reach, 0.0, 0.0
            _begin(sens, k, column, o, BoucWen(0.0, by_a, by_n, by_loss, by_loss, 0.0))
        elif codes[k] == _PRESLIDING:
            share = _SHARES[int(p[o + 3]) - 1] if p[o + 3] > 0.0 else 1.0
            memory[k] = s * share * p[o + 1]
            _begin(sens, k, column, o, (0.0, s * share))
        elif codes[k] == _LUGRE:
            r = _lugre_of(p, o)
            g, _, e = bristle_level(r, w)
            y = w / r.w_s
            memory[k] = s * g / r.sigma0
            by_w_s = s * (r.f_s - r.f_c) * e * 2.0 * y * y / (r.w_s * r.sigma0)
            by = LuGre(-memory[k] / r.sigma0, 0.0, s * (1.0 - e) / r.sigma0, s * e / r.sigma0, by_w_s)
            _begin(sens, k, column, o, by)
        elif codes[k] == _REVERSAL:
            memory[k] = 1e300
        elif codes[k] == _SELECTIVE:
            memory[k] = w
        elif codes[k] == _GAS and core.memory[k]:
            memory[k] = _before(gas_of(p, o), x, sens, k, column, o)


@compiled
def _before(q, x, sens, k, column, o):
    """`_behind` at the first sample: out of rest there, or out of a motion like that along `x`, or between both."""
    start, y, by_length, by_n = tended_to(q, x[0]), 0.0, 0.0, 0.0
    for i in range(x.size):
        rise = tended_to(q, x[i])
        y, by_length, by_n = y + rise.y / x.size, by_length + rise.by_length / x.size, by_n + rise.by_n / x.size
    moved = 1.0 - q.rested
    _begin(
        sens, k, column, o, (0.0, moved * (by_length - start.by_length), moved * (by_n - start.by_n), 0.0, start.y - y)
    )
    return moved * (y - start.y)


@inlined
def highest(v):
    """The largest size of a velocity, and no zero."""
    top = 1e-300
    for i in range(v.size):
        top = max(top, abs(v[i]))
    return top


@inlined
def _half_stroke(x):
    low, high = x[0], x[0]
    for i in range(x.size):
        low, high = min(low, x[i]), max(high, x[i])
    return 0.5 * (high - low)


@inlined
def _begin(sens, k, column, o, by):
    if sens.shape[1] > 0:
        for j in range(len(by)):
            if column[o + j] >= 0:
                sens[k, column[o + j]] = by[j]


@inlined
def rate(p, o, w, h):
    """dh/dt of a Bouc–Wen hysteresis, its slopes by w and h, and h |h|^(n−1)."""
    q = bouc_wen_of(p, o)
    m = abs(h) ** (q.n - 1.0)
    s, sgn = (1.0 if w > 0.0 else -1.0), (1.0 if h > 0.0 else -1.0)
    by_w = q.A - s * h * m * (q.gamma + s * sgn * q.beta)
    return by_w * w, by_w, -q.n * m * (q.gamma * abs(w) + q.beta * w * sgn), h * m


@inlined
def add_rate_partials(out, column, p, o, w, h, pull):
    """Adds to the columns of `out` what that rate owes to the hysteresis' own parameters; `pull` is h |h|^(n−1)."""
    q = bouc_wen_of(p, o)
    if column[o + 1] >= 0:
        out[column[o + 1]] += w
    if column[o + 2] >= 0:
        out[column[o + 2]] -= (q.gamma * abs(w) * pull + q.beta * w * abs(pull)) * _log(h)
    if column[o + 3] >= 0:
        out[column[o + 3]] -= w * abs(pull)
    if column[o + 4] >= 0:
        out[column[o + 4]] -= abs(w) * pull


@compiled
def fading_rate(p, o):
    """How fast a Bouc–Wen hysteresis fades with travel, 1/m."""
    q = bouc_wen_of(p, o)
    return 1.0 / fading(q, q.n)
