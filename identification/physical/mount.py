"""The mount: a spring and damper in series with the core, beyond a gap, with a relaxing branch beside them."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)


class Contact(NamedTuple):
    """Force of the mount's spring and damper, its slopes by e and de/dt, and its partials by its parameters."""

    f: float
    by_e: float
    by_rate: float
    by_k: float
    by_c: float
    by_gap: float
    by_air: float
    by_half: float
    by_side: float


@compiled
def _through_air(mount, s, d, c, rate):
    """The same in series with air that gives way by d = h f/(f_h + f), f > 0: half of it by the force f_h.

    With q = f_h/k and a = q + h − d the force of both in series is f = k (√(a² + 4 d q) − a)/2. The damper stands
    beside the spring alone, which takes the share g = (df/dd)/k of the rate. The same air yields on each side by an
    area of its own: w times their mean, so that it gives way by less, under more force.
    """
    k, w = mount.k, 1.0 + s * mount.side
    h, q = 0.5 * mount.air / w, mount.f_half * w / mount.k
    a = q + h - d
    r = np.sqrt(a * a + 4.0 * d * q)
    f = 2.0 * k * d * q / (r + a) if a > 0.0 else 0.5 * k * (r - a)
    g = 0.5 * (1.0 + (2.0 * q - a) / r)
    cubed = r * r * r
    g_d, g_h = 2.0 * q * h / cubed, -q * (2.0 * d + a) / cubed
    f_q, g_q = 0.5 * k * ((a + 2.0 * d) / r - 1.0), 0.5 * (1.0 / r - (2.0 * q - a) * (a + 2.0 * d) / cubed)
    stretched = c * rate
    by_e = k * g + s * stretched * g_d
    by_q = s * f_q + stretched * g_q
    by_h = 0.5 * s * k * (a / r - 1.0) + stretched * g_h
    return Contact(
        s * f + stretched * g,
        by_e,
        c * g,
        s * f / k - q / k * by_q,
        rate * g,
        -0.5 * s * by_e,
        0.5 * by_h / w,
        w * by_q / k,
        s * (q * by_q - h * by_h) / w,
    )


@compiled
def _beyond(mount, c, e, rate):
    """A spring and damper beyond half a gap, in series with what air gives way by."""
    k, half = mount.k, 0.5 * mount.gap
    if abs(e) <= half and half > 0.0:
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    s = 1.0 if e > 0 else -1.0
    d = abs(e) - half
    if mount.air > 0.0:
        met = _through_air(mount, s, d, c, rate)
    else:
        met = Contact(s * k * d + c * rate, k, c, s * d, rate, -0.5 * k * s, 0.0, 0.0, 0.0)
    if half > 0.0 and met.f * s <= 0.0:  # a contact can push and be pushed, not stick
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return met


@inlined
def contact(mount, u, e, rate):
    """The spring and damper of a mount at the current `u`."""
    c = mount.c + mount.c_control * u
    if mount.gap > 0.0 or mount.air > 0.0:
        return _beyond(mount, c, e, rate)
    return Contact(mount.k * e + c * rate, mount.k, c, e, rate, 0.0, 0.0, 0.0, 0.0)


class Slip(NamedTuple):
    """Force of the friction beside the spring after a leg, its slopes by e, the force before and its own parameters."""

    y: float
    by_e: float
    by_y: float
    by_k: float
    by_f: float


@compiled
def slip(mount, y, de):
    """Friction that acts as a spring before it slides, from the force `y` over a change of extension `de` one way.

    Exact: dy/de = k (1 − s y/f) gives s f + (y − s f) exp(−k |de|/f), s the direction.
    """
    k, top = mount.k_slip, mount.f_slip
    s = 1.0 if de >= 0.0 else -1.0
    fade = np.exp(-k * abs(de) / top)
    gap = y - s * top
    new = s * top + gap * fade
    by_f = s * (1.0 - fade) + gap * fade * k * abs(de) / (top * top)
    return Slip(new, -s * gap * fade * k / top, fade, -gap * fade * abs(de) / top, by_f)


@inlined
def branch(mount, f2, gh):
    """Force of the relaxing branch at the end of an implicit stage as `b0 + b1·de/dt`, from its force `f2` before.

    df2/dt = k2 (de/dt − f2/c2), hence f2 + γh k2 de/dt over 1 + γh k2/c2.
    """
    if mount.k2 == 0.0:
        return 0.0, 0.0
    q = 1.0 / (1.0 + gh * mount.k2 / mount.c2)
    return f2 * q, gh * mount.k2 * q


@inlined
def branch_partials(mount, force, gh, rate):
    """Slopes of that force by f2, k2 and c2."""
    k2, c2 = mount.k2, mount.c2
    q = 1.0 / (1.0 + gh * k2 / c2)
    return q, (gh * rate - force * gh / c2) * q, force * gh * k2 / (c2 * c2) * q


@inlined
def add_mount_partials(out, mounting, e, rate, u, scale):
    """Adds `scale` times the partials of the contact's force by its own parameters to the columns of `out`."""
    mount, column = mounting
    met = contact(mount, u, e, rate)
    if column.k >= 0:
        out[column.k] += scale * met.by_k
    if column.c >= 0:
        out[column.c] += scale * met.by_c
    if column.gap >= 0:
        out[column.gap] += scale * met.by_gap
    if column.air >= 0:
        out[column.air] += scale * met.by_air
    if column.f_half >= 0:
        out[column.f_half] += scale * met.by_half
    if column.side >= 0:
        out[column.side] += scale * met.by_side
    if column.c_control >= 0:
        out[column.c_control] += scale * u * met.by_c
