"""The mount: a spring and damper in series with the core, beyond a gap, with a relaxing branch beside them."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import inlined

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)


class Contact(NamedTuple):
    """Force of the mount's spring and damper, its slopes by e and de/dt, and its partials by k, c and gap."""

    f: float
    by_e: float
    by_rate: float
    by_k: float
    by_c: float
    by_gap: float


@inlined
def contact(mount, u, e, rate):
    """A spring and damper beyond half the gap, at the current `u`."""
    k, c, gap = mount.k, mount.c + mount.c_control * u, mount.gap
    if gap == 0.0:
        return Contact(k * e + c * rate, k, c, e, rate, 0.0)
    if abs(e) <= 0.5 * gap:
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    s = 1.0 if e > 0 else -1.0
    d = e - s * 0.5 * gap
    f = k * d + c * rate
    if f * s <= 0.0:  # a contact can push and be pushed, not stick
        return Contact(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Contact(f, k, c, d, rate, -0.5 * k * s)


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
    if column.c_control >= 0:
        out[column.c_control] += scale * u * met.by_c
