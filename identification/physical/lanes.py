"""The core of a damper at the three stages of a step at once: what an element is gets asked once for all three."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.physical.compiled import compiled, inlined
from identification.physical.core import rare_forces
from identification.physical.damping import damping
from identification.physical.elements import Code
from identification.physical.friction import friction
from identification.physical.modifiers import modify
from identification.physical.springs import spring

_ARCTAN, _TANH, _PRESLIDING, _STOP = int(Code.ARCTAN), int(Code.TANH), int(Code.PRESLIDING), int(Code.STOP)
U, TEMPERATURE, ACCELERATION, AMPLITUDE = range(4)  # columns of what drives a core beside its motion

# Three numbers travel as a tuple, and not in an array: that would cost a trip through memory at every element.


@inlined
def _plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _damping(code, p, o, z, w, driver, dp):
    """Forces, slopes by z and slopes by w."""
    f0, z0, w0, _ = damping(code, p, o, z[0], w[0], driver[0, U], dp, False)
    f1, z1, w1, _ = damping(code, p, o, z[1], w[1], driver[1, U], dp, False)
    f2, z2, w2, _ = damping(code, p, o, z[2], w[2], driver[2, U], dp, False)
    return (f0, f1, f2), (z0, z1, z2), (w0, w1, w2)


@inlined
def _friction(code, p, o, w, driver, dp, dm, k):
    f0, w0, _, _ = friction(code, p, o, w[0], 0.0, driver[0, U], 0.0, dp, dm, k, False)
    f1, w1, _, _ = friction(code, p, o, w[1], 0.0, driver[1, U], 0.0, dp, dm, k, False)
    f2, w2, _, _ = friction(code, p, o, w[2], 0.0, driver[2, U], 0.0, dp, dm, k, False)
    return (f0, f1, f2), (w0, w1, w2)


@inlined
def _spring(code, p, o, z, dp):
    f0, z0 = spring(code, p, o, z[0], dp, False)
    f1, z1 = spring(code, p, o, z[1], dp, False)
    f2, z2 = spring(code, p, o, z[2], dp, False)
    return (f0, f1, f2), (z0, z1, z2)


@compiled
def _changed(s, codes, offsets, p, z, w, driver, f, f_z, f_w, memory, dp, dm):
    """Dissipative force of one stage with what few models hold: rare elements, and factors on the sum."""
    more, more_w, _ = rare_forces(
        codes, offsets, p, z, w, driver[s, U], driver[s, ACCELERATION], driver[s, AMPLITUDE], memory, dp, dm
    )
    f += more
    factor, factor_z = modify(codes, offsets, p, z, driver[s, TEMPERATURE], memory, f, dp, dm, False)
    return f * factor, f_z * factor + f * factor_z, (f_w + more_w) * factor


@inlined
def core_values(codes, offsets, p, z, w, driver, memory, dp, dm, changed):
    """Forces and their slopes by z and w at three stages, as `core_force` has them, of a smooth core without memory.

    driver : (3, 4) float64; `changed` says whether any element is rare or a factor.
    """
    none = (0.0, 0.0, 0.0)
    diss, diss_z, diss_w, other, other_z = none, none, none, none, none
    for k in range(codes.size):
        code, o = codes[k], offsets[k]
        if o < 0 or o > p.size:
            break  # never; said so that no access below has to ask whether its index counts from the end
        f, f_z, f_w = none, none, none
        if code == _ARCTAN:  # the stiff models of the literature: a constant leaves one branch of `damping`
            f, f_z, f_w = _damping(_ARCTAN, p, o, z, w, driver, dp)
            other = _plus(other, (p[o + 3], p[o + 3], p[o + 3]))
        elif code <= _TANH:
            f, f_z, f_w = _damping(code, p, o, z, w, driver, dp)
        elif code <= _PRESLIDING:
            f, f_w = _friction(code, p, o, w, driver, dp, dm, k)
        elif code <= _STOP:
            stored, stored_z = _spring(code, p, o, z, dp)
            other, other_z = _plus(other, stored), _plus(other_z, stored_z)
        diss, diss_z, diss_w = _plus(diss, f), _plus(diss_z, f_z), _plus(diss_w, f_w)
    if changed:
        a, a_z, a_w = _changed(0, codes, offsets, p, z[0], w[0], driver, diss[0], diss_z[0], diss_w[0], memory, dp, dm)
        b, b_z, b_w = _changed(1, codes, offsets, p, z[1], w[1], driver, diss[1], diss_z[1], diss_w[1], memory, dp, dm)
        c, c_z, c_w = _changed(2, codes, offsets, p, z[2], w[2], driver, diss[2], diss_z[2], diss_w[2], memory, dp, dm)
        diss, diss_z, diss_w = (a, b, c), (a_z, b_z, c_z), (a_w, b_w, c_w)
    return _plus(diss, other), _plus(diss_z, other_z), diss_w
