"""The core of a damper: parallel elements, summed, with every partial derivative."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.physical.compiled import compiled, inlined
from identification.physical.damping import damping, motion_damping
from identification.physical.elements import Code
from identification.physical.friction import bristles, friction
from identification.physical.modifiers import modify
from identification.physical.springs import spring

_ARCTAN, _TANH, _PRESLIDING, _STOP = int(Code.ARCTAN), int(Code.TANH), int(Code.PRESLIDING), int(Code.STOP)
_MODULATED, _LUGRE = int(Code.MODULATED_TANH), int(Code.LUGRE)


@compiled
def has_rare(codes):
    """Whether any element is one of `rare_forces`."""
    found = False
    for code in codes:
        found = found or code >= _MODULATED
    return found


@compiled  # and not inlined: the size of these would slow down all the others
def rare_forces(codes, offsets, p, z, w, u, a, v_m, memory, dp, dm):
    """Force of the elements that few models hold, and its slopes by w and u."""
    diss, diss_w, diss_u = 0.0, 0.0, 0.0
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if code == _LUGRE:
            f, f_w = bristles(p, o, w, memory[k], dp, dm, k)
            diss += f
            diss_w += f_w
        elif code >= _MODULATED:
            f, f_w, f_u = motion_damping(code, p, o, z, w, u, a, v_m, dp)
            diss += f
            diss_w += f_w
            diss_u += f_u
    return diss, diss_w, diss_u


@inlined
def core_force(codes, offsets, p, z, w, s, u, temperature, a, v_m, memory, dp, dm, modified, rare, wanted):
    """Force of the parallel elements and its partial derivatives.

    `s` is the sign of sliding, given apart from `w` so that a stick can be asked for; `a` and `v_m` belong to the rig's
    motion; `modified` and `rare` say whether any element is of that sort. Fills `dm` (by memory slot) and, where
    `wanted`, `dp` (by parameter). Returns f, ∂f/∂z, ∂f/∂w, ∂f/∂u and the height of the dry-friction step at w = 0.
    """
    diss, diss_z, diss_w, diss_u, jump = 0.0, 0.0, 0.0, 0.0, 0.0
    other, other_z = 0.0, 0.0
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if code <= _TANH:
            f, f_z, f_w, f_u = damping(code, p, o, z, w, u, dp, wanted)
            diss += f
            diss_z += f_z
            diss_w += f_w
            diss_u += f_u
            if code == _ARCTAN:
                other += p[o + 3]
        elif code <= _PRESLIDING:
            f, f_w, f_u, step = friction(code, p, o, w, s, u, memory[k], dp, dm, k, wanted)
            diss += f
            diss_w += f_w
            diss_u += f_u
            jump += step
        elif code <= _STOP:
            f, f_z = spring(code, p, o, z, dp, wanted)
            other += f
            other_z += f_z
    if rare:
        f, f_w, f_u = rare_forces(codes, offsets, p, z, w, u, a, v_m, memory, dp, dm)
        diss += f
        diss_w += f_w
        diss_u += f_u
    factor, factor_z = 1.0, 0.0
    if modified:
        factor, factor_z = modify(codes, offsets, p, z, temperature, memory, diss, dp, dm, wanted)
    f_z = diss_z * factor + diss * factor_z + other_z
    return diss * factor + other, f_z, diss_w * factor, diss_u * factor, jump * factor
