"""The core of a damper: parallel elements, summed, with every partial derivative."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled, inlined
from identification.physical.elements import SHIFT, Family
from identification.physical.elements.equations.damping import ASYMMETRY, SHARE, damping
from identification.physical.elements.equations.friction import friction
from identification.physical.elements.equations.modifiers import modifier
from identification.physical.elements.equations.motion import motion_force
from identification.physical.elements.equations.point import Force
from identification.physical.elements.equations.springs import spring
from identification.physical.program import FACTOR, SCALED

_DAMPING, _FRICTION, _SPRING = int(Family.DAMPING), int(Family.FRICTION), int(Family.SPRING)
_MOTION, _MODIFIER = int(Family.MOTION), int(Family.MODIFIER)


@compiled  # and not inlined: the size of these would slow down all the others
def rare_forces(core, at, memory, work):
    """Force of the elements of the motion family, and its slopes by w and u; fills their partials."""
    f, f_w, f_u = 0.0, 0.0, 0.0
    for k in range(core.codes.size):
        code = core.codes[k]
        if code >> SHIFT == _MOTION:
            own = motion_force(code, core.p, core.offsets[k], at, memory[k], work.dp)
            work.dm[k] = own.by_memory
            f += own.f
            f_w += own.by_w
            f_u += own.by_u
    return f, f_w, f_u


@compiled
def lean(core, at, work, wanted):
    """What asymmetries add as a share of the size of all other damping curves, share·|f_d|, with its slopes by z, w and
    u; where `wanted`, it brings the partials of these curves to their changed force."""
    share, f, f_z, f_w, f_u = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(core.codes.size):
        code, o = core.codes[k], core.offsets[k]
        if code == ASYMMETRY:
            share += core.p[o + SHARE]
        elif code >> SHIFT == _DAMPING:
            own = damping(code, core.p, o, at, work.dp, False)
            f += own.f
            f_z += own.by_z
            f_w += own.by_w
            f_u += own.by_u
    side = 1.0 if f > 0.0 else -1.0
    more = share * side
    for k in range(core.codes.size if wanted else 0):
        code, o = core.codes[k], core.offsets[k]
        if code == ASYMMETRY:
            work.dp[o + SHARE] = abs(f)
        elif code >> SHIFT == _DAMPING:
            for j in range(o, core.offsets[k + 1]):
                if core.scaling[j] == SCALED:
                    work.dp[j] *= 1.0 + more
    return more * f, more * f_z, more * f_w, more * f_u


@inlined
def modify(core, at, memory, diss, work, wanted):
    """Product of the factors on the dissipative sum and its slopes by z and w.

    Brings `dm` and, where `wanted`, `dp` to the modified force: SCALED partials times the product, those of the factors
    themselves, relative until then, times the force.
    """
    codes, dp, dm = core.codes, work.dp, work.dm
    factor, factor_z, factor_w = 1.0, 0.0, 0.0
    for k in range(codes.size):
        if codes[k] >> SHIFT == _MODIFIER:
            own = modifier(codes[k], core.p, core.offsets[k], at, memory[k], dp)
            factor_z = factor_z * own.m + factor * own.by_z
            factor_w = factor_w * own.m + factor * own.by_w
            factor *= own.m
            dm[k] = own.by_memory
    for k in range(codes.size):
        if codes[k] >> SHIFT == _MODIFIER:
            dm[k] *= diss * factor
        elif core.memory[k] and codes[k] >> SHIFT != _SPRING:
            dm[k] *= factor
    if wanted:
        for j in range(core.p.size):
            if core.scaling[j] == SCALED:
                dp[j] *= factor
            elif core.scaling[j] == FACTOR:
                dp[j] *= diss * factor
    return factor, factor_z, factor_w


@inlined
def core_force(core, at, memory, work, wanted):
    """Force of the parallel elements with its slopes, at a `Point`.

    Fills `work.dm` by memory and, where `wanted`, `work.dp` by parameter.
    """
    diss, diss_z, diss_w, diss_u, jump = 0.0, 0.0, 0.0, 0.0, 0.0
    other, other_z = 0.0, 0.0
    for k in range(core.codes.size):
        code, o = core.codes[k], core.offsets[k]
        family = code >> SHIFT
        if family == _DAMPING:
            own = damping(code, core.p, o, at, work.dp, wanted)
            diss += own.f
            diss_z += own.by_z
            diss_w += own.by_w
            diss_u += own.by_u
            other += own.outside
        elif family == _FRICTION:
            own = friction(code, core.p, o, at, memory[k], work.dp, wanted)
            diss += own.f
            diss_w += own.by_w
            diss_u += own.by_u
            jump += own.jump
            work.dm[k] = own.by_memory
        elif family == _SPRING:
            f, f_z, work.dm[k] = spring(code, core.p, o, at.z, at.temperature, memory[k], work.dp, wanted)
            other += f
            other_z += f_z
    if core.leans:
        f, f_z, f_w, f_u = lean(core, at, work, wanted)
        diss += f
        diss_z += f_z
        diss_w += f_w
        diss_u += f_u
    if core.rare:
        f, f_w, f_u = rare_forces(core, at, memory, work)
        diss += f
        diss_w += f_w
        diss_u += f_u
    factor, factor_z, factor_w = 1.0, 0.0, 0.0
    if core.modified:
        factor, factor_z, factor_w = modify(core, at, memory, diss, work, wanted)
    f_z, f_w = diss_z * factor + diss * factor_z + other_z, diss_w * factor + diss * factor_w
    return Force(diss * factor + other, f_z, f_w, diss_u * factor, 0.0, jump * factor, 0.0)
