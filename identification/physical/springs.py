"""Elements whose force follows from the position: they store, and stand outside the dissipative sum."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import inlined
from identification.physical.elements import Code

_STIFFNESS, _CUBIC, _GAS, _STOP = int(Code.STIFFNESS), int(Code.CUBIC), int(Code.GAS), int(Code.STOP)


@inlined
def spring(code, p, o, z, dp, wanted):
    """Force and its slope by z; where `wanted`, its partials too."""
    f, f_z = 0.0, 0.0
    if code == _STIFFNESS:  # k z
        f = p[o] * z
        f_z = p[o]
        if wanted:
            dp[o] = z
    elif code == _CUBIC:  # k3 z³
        f = p[o] * z * z * z
        f_z = 3.0 * p[o] * z * z
        if wanted:
            dp[o] = z * z * z
    elif code == _GAS:  # −f0 (1 + z/length)^(−n)
        b = max(1.0 + z / p[o + 1], 0.02)
        q = b ** (-p[o + 2])
        f = -p[o] * q
        slope = p[o] * p[o + 2] * q / b
        f_z = slope / p[o + 1]
        if wanted:
            dp[o] = -q
            dp[o + 1] = -slope * z / (p[o + 1] * p[o + 1])
            dp[o + 2] = p[o] * q * np.log(b)
    elif code == _STOP:  # k max(0, z − z_max) − k max(0, −z_max − z)
        if wanted:
            dp[o] = 0.0
            dp[o + 1] = 0.0
        if abs(z) > p[o + 1]:
            sgn = 1.0 if z > 0 else -1.0
            f = p[o] * (z - sgn * p[o + 1])
            f_z = p[o]
            if wanted:
                dp[o] = z - sgn * p[o + 1]
                dp[o + 1] = -sgn * p[o]
    return f, f_z
