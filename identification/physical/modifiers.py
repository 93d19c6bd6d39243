"""Factors on the dissipative sum: position, temperature, and the travel since the last reversal."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import compiled, inlined
from identification.physical.elements import Code

_ARCTAN, _BOUC_WEN, _PRESLIDING = int(Code.ARCTAN), int(Code.BOUC_WEN), int(Code.PRESLIDING)
_POSITION, _FADE, _REVERSAL = int(Code.POSITION), int(Code.FADE), int(Code.REVERSAL_LAG)
_MODULATED, _LUGRE = int(Code.MODULATED_TANH), int(Code.LUGRE)


@compiled
def has_modifier(codes):
    """Whether any element multiplies the dissipative sum."""
    found = False
    for code in codes:
        found = found or code in (_POSITION, _FADE, _REVERSAL)
    return found


@inlined
def is_dissipative(code):
    """Whether an element's force counts to the dissipative sum."""
    return code <= _PRESLIDING or code >= _MODULATED


@compiled
def modify(codes, offsets, p, z, temperature, memory, diss, dp, dm, wanted):
    """Product of the factors on the dissipative sum and its slope by z; brings `dm` and, where `wanted`, `dp` to
    the modified force."""
    factor, factor_z = 1.0, 0.0
    for k in range(codes.size):
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
            far = memory[k] / p[o]  # before the first reversal beyond all bounds
            e = np.exp(-far)
            m = max(1.0 - e, 1e-12)
            factor *= m
            factor_z *= m
            dp[o] = -(far * e) / p[o] / m
            dm[k] = e / p[o] / m
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if code == _REVERSAL:
            dm[k] *= diss * factor
        elif code in (_BOUC_WEN, _PRESLIDING, _LUGRE):
            dm[k] *= factor
        if wanted:
            scale = 1.0
            if code in (_POSITION, _REVERSAL, _FADE):
                scale = diss * factor
            elif is_dissipative(code):
                scale = factor
            end = offsets[k + 1]
            for j in range(o, end - 1 if code == _ARCTAN else end):  # F2 of an arctan stands outside the sum
                dp[j] *= scale
    return factor, factor_z
