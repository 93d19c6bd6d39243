"""The mount: a spring and damper in series with the core, beyond a gap, with a relaxing branch beside them."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import inlined

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)
K, C, GAP, K2, C2, C_CONTROL = range(6)  # entries of the mount's array, and of that of its gradient columns


@inlined
def contact(k, c, gap, e, rate):
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


@inlined
def branch(mount, f2, gh):
    """Force of the relaxing branch at the end of an implicit stage as `b0 + b1·de/dt`, from its force `f2` before.

    df2/dt = k2 (de/dt − f2/c2), hence f2 + γh k2 de/dt over 1 + γh k2/c2.
    """
    if mount[K2] == 0.0:
        return 0.0, 0.0
    q = 1.0 / (1.0 + gh * mount[K2] / mount[C2])
    return f2 * q, gh * mount[K2] * q


@inlined
def branch_partials(mount, force, gh, rate):
    """Slopes of that force by f2, k2 and c2."""
    k2, c2 = mount[K2], mount[C2]
    q = 1.0 / (1.0 + gh * k2 / c2)
    return q, (gh * rate - force * gh / c2) * q, force * gh * k2 / (c2 * c2) * q


@inlined
def add_mount_partials(out, column, e, rate, u, mount, scale):
    """Adds `scale` times the partials of the contact's force by its own parameters to the columns of `out`."""
    _, _, _, by_k, by_c, by_gap = contact(mount[K], mount[C] + mount[C_CONTROL] * u, mount[GAP], e, rate)
    if column[K] >= 0:
        out[column[K]] += scale * by_k
    if column[C] >= 0:
        out[column[C]] += scale * by_c
    if column[GAP] >= 0:
        out[column[GAP]] += scale * by_gap
    if column[C_CONTROL] >= 0:
        out[column[C_CONTROL]] += scale * u * by_c
