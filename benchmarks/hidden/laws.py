"""The specimen's force laws, compiled: each near the catalogue's form, and different where `q` is not zero.

`q` is the departure: how far the real effect is from the textbook curve. Zero gives the textbook curve, which
only the sizing of a case uses. Nothing here is shared with the program under test.
"""

from __future__ import annotations

from math import atan, copysign, cos, exp, pi, sin, sqrt, tanh

import numba


def compiled(function):  # type: ignore[no-untyped-def]
    """Compile without Python objects, cached, with IEEE division."""
    return numba.njit(cache=True, error_model="numpy")(function)


def inlined(function):  # type: ignore[no-untyped-def]
    """Compile into the caller: passing arrays takes longer than the arithmetic."""
    return numba.njit(inline="always", error_model="numpy")(function)


@compiled
def sign(value):
    return (value > 0.0) - (value < 0.0)


@compiled
def knee(excess, width):
    """Rounded max(0, excess)."""
    return 0.5 * (excess + sqrt(excess * excess + width * width))


@compiled
def shear_thinning(c, w, q, speed):
    return c * w / (1.0 + q * abs(w) / speed)


@compiled
def saturating_valve(force, steepness, w, q):
    """Arctangent blended with the root of a saturating orifice."""
    y = steepness * w
    curve = atan(y) * 2.0 / pi
    if q != 0.0:
        y = abs(y)
        curve += q * (copysign(sqrt(tanh(y * y / (y + 0.2))), w) - curve)
    return force * curve


@compiled
def blow_off(c1, c2, force, w, q):
    """Two slopes, the corner rounded by the spread of the valve discs."""
    corner = force / c1
    width = 2.0 * q * corner
    past = knee(abs(w) - corner, width) - knee(-corner, width)
    return copysign(c1 * abs(w) - (c1 - c2) * past, w)


@compiled
def spool(c_soft, c_firm, u_soft, u_firm, w_knee, w, u, q):
    share = min(max((u - u_soft) / (u_firm - u_soft), 0.0), 1.0)
    c = c_soft + share * (c_firm - c_soft)
    if q == 0.0:
        return c * w / sqrt(1.0 + (w / w_knee) ** 2)
    return c * w / (1.0 + abs(w / w_knee) ** (2.0 + q)) ** (1.0 / (2.0 + q))


@compiled
def orifice(coefficient, w, q, speed):
    """Exponent 2 − q: between a sharp-edged orifice and a long port."""
    return coefficient * w * abs(w) * (abs(w) / speed + 1e-3) ** (-q)


@compiled
def opening_relief(c_drop, w_knee, w, q):
    width = q * w_knee
    return -c_drop * copysign(knee(abs(w) - w_knee, width) - knee(-w_knee, width), w)


@compiled
def rebound_bias(c_a, w, q, speed):
    return c_a * abs(w) * (abs(w) / speed + 0.05) ** q


@compiled
def sliding_tanh(alpha, beta, delta, z, w, q, stroke):
    side = tanh(z / (max(0.05 * q, 0.004) * stroke))
    y = beta * w + delta * side
    return alpha * ((1.0 - q) * tanh(y) + q * y / sqrt(1.0 + y * y))


@compiled
def wen_slope(h, direction, a, beta, gamma, n):
    size = abs(h) ** n
    return a - size * (gamma * direction * sign(h) + beta)


@compiled
def wen_step(h, dz, a, beta, gamma, n):
    """Advance h over the travel dz by the midpoint rule."""
    direction = sign(dz)
    middle = h + 0.5 * dz * wen_slope(h, direction, a, beta, gamma, n)
    return h + dz * wen_slope(middle, direction, a, beta, gamma, n)


@compiled
def seal_friction(f_c, z, w, q, speed, stroke):
    """Dry friction of a seal on a tube whose tightness varies along the stroke."""
    return f_c * tanh(w / (0.002 * speed)) * (1.0 + q * sin(4.0 * z / stroke + 1.0))


@compiled
def breakaway(f_c, f_s, w_s, w, q, speed):
    r = (w / w_s) ** 2
    rise = (1.0 - q) * exp(-r) + q / (1.0 + r)
    return (f_c + (f_s - f_c) * rise) * tanh(w / (0.002 * speed))


@compiled
def dahl_step(f, dz, sigma, f_c, q):
    """Advance a bristle force over the travel dz; Dahl's exponent is 1 + q."""
    direction = sign(dz)
    gap = max(1.0 - direction * f / f_c, 0.0)
    if q == 0.0:
        return f_c * direction * (1.0 - gap * exp(-sigma * abs(dz) / f_c))
    middle = f + 0.5 * sigma * dz * gap ** (1.0 + q)
    gap = max(1.0 - direction * middle / f_c, 0.0)
    return f + sigma * dz * gap ** (1.0 + q)


@compiled
def rubber(k, z, q, stroke):
    return k * z * (1.0 + q * abs(z) / stroke)


@compiled
def progressive(k3, z, q, stroke):
    return k3 * z**3 * (abs(z) / stroke + 0.02) ** q


@compiled
def gas(f0, length, n, z, temperature, q):
    """Polytropic preload that follows the body temperature in part."""
    return -f0 * (1.0 + z / length) ** (-n) * (1.0 + q * (temperature - 25.0) / 298.0)


@compiled
def bump_stop(k, z_max, z, q, stroke):
    """A rubber stop, a little nearer on one side, stiffening under compression."""
    out = max(0.0, z - z_max * (1.0 + 0.1 * q))
    back = max(0.0, -z - z_max * (1.0 - 0.1 * q))
    if q == 0.0:
        return k * (out - back)
    reference = 0.1 * stroke
    return k * reference * ((out / reference) ** (1.0 + q) - (back / reference) ** (1.0 + q))


@compiled
def bypass_groove(p, z, q, stroke):
    return 1.0 + p * z * z / (1.0 + q * (z / stroke) ** 2)


@compiled
def thinning_oil(kappa, t_ref, temperature, q):
    """Vogel-like: the viscosity falls faster when cold."""
    warm = temperature - t_ref
    return exp(-kappa * warm / (1.0 + q * warm / 100.0))


@compiled
def trapped_gas(travel, length, q):
    r = travel / length
    return (1.0 - q) * (1.0 - exp(-r)) + q * r * r / (1.0 + r * r)


@compiled
def coil_saturation(i_s, i, q):
    y = i / i_s
    return i_s * ((1.0 - q) * tanh(y) + q * y / sqrt(1.0 + y * y))


@compiled
def play_step(u, i, width):
    return min(max(u, i - 0.5 * width), i + 0.5 * width)


@compiled
def ringing(age, amplitude, frequency, decay):
    return amplitude * exp(-age / decay) * cos(2.0 * pi * frequency * age)
