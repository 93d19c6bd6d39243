"""The core of a damper at the three stages of a step at once: what an element is gets asked once for all three."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled, inlined
from identification.physical.core import lean, modify, rare_forces
from identification.physical.elements import SHIFT, Family
from identification.physical.elements.equations.damping import STIFF, damping
from identification.physical.elements.equations.friction import friction
from identification.physical.elements.equations.point import Point
from identification.physical.elements.equations.springs import spring

_DAMPING, _FRICTION, _SPRING = int(Family.DAMPING), int(Family.FRICTION), int(Family.SPRING)
U, TEMPERATURE, ACCELERATION, AMPLITUDE = range(4)  # columns of what drives a core beside its motion

# Three numbers travel as a tuple, and not in an array: that would cost a trip through memory at every element.


@inlined
def _plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _at(z, w, driver, stage):
    """The point at one stage, as far as damping and friction look at it."""
    return Point(z[stage], w[stage], 0.0, driver[stage, U], 0.0, 0.0, 0.0)


@inlined
def _damping(code, core, o, points, dp):
    """Forces, slopes by z, slopes by w, and what stands outside the dissipative sum."""
    a = damping(code, core.p, o, points[0], dp, False)
    b = damping(code, core.p, o, points[1], dp, False)
    c = damping(code, core.p, o, points[2], dp, False)
    outside = (a.outside, b.outside, c.outside)
    return (a.f, b.f, c.f), (a.by_z, b.by_z, c.by_z), (a.by_w, b.by_w, c.by_w), outside


@inlined
def _friction(code, core, o, points, dp):
    a = friction(code, core.p, o, points[0], 0.0, dp, False)
    b = friction(code, core.p, o, points[1], 0.0, dp, False)
    c = friction(code, core.p, o, points[2], 0.0, dp, False)
    return (a.f, b.f, c.f), (a.by_w, b.by_w, c.by_w)


@inlined
def _spring(code, core, o, z, driver, dp):
    f0, z0, _ = spring(code, core.p, o, z[0], driver[0, TEMPERATURE], 0.0, dp, False)
    f1, z1, _ = spring(code, core.p, o, z[1], driver[1, TEMPERATURE], 0.0, dp, False)
    f2, z2, _ = spring(code, core.p, o, z[2], driver[2, TEMPERATURE], 0.0, dp, False)
    return (f0, f1, f2), (z0, z1, z2)


@compiled
def _changed(stage, core, z, w, driver, forces, memory, work):
    """Dissipative force of one stage with what few models hold: the motion family, a side, and factors on the sum."""
    f, f_z, f_w = forces
    temperature, a, v_m = driver[stage, TEMPERATURE], driver[stage, ACCELERATION], driver[stage, AMPLITUDE]
    at = Point(z, w, 0.0, driver[stage, U], temperature, a, v_m)
    more, more_w, _ = rare_forces(core, at, memory, work)
    if core.leans:
        own, own_z, own_w, _ = lean(core, at, work, False)
        more, f_z, more_w = more + own, f_z + own_z, more_w + own_w
    f += more
    factor, factor_z, factor_w = modify(core, at, memory, f, work, False)
    return f * factor, f_z * factor + f * factor_z, (f_w + more_w) * factor + f * factor_w


@inlined
def core_values(core, z, w, driver, memory, work, changed):
    """Forces and their slopes by z and w at three stages, as `core_force` has them, of a smooth core without memory.

    driver : (3, 4) float64; `changed` says whether any element is of the motion family, a factor or an
    asymmetry in proportion to the other curves.
    """
    none = (0.0, 0.0, 0.0)
    diss, diss_z, diss_w, other, other_z = none, none, none, none, none
    points = (_at(z, w, driver, 0), _at(z, w, driver, 1), _at(z, w, driver, 2))
    for k in range(core.codes.size):
        code, o = core.codes[k], core.offsets[k]
        if o < 0 or o > core.p.size:
            break  # never; said so that no access below has to ask whether its index counts from the end
        family = code >> SHIFT
        f, f_z, f_w = none, none, none
        if code == STIFF:  # the stiff models of the literature: a constant leaves one branch of `damping`
            f, f_z, f_w, outside = _damping(STIFF, core, o, points, work.dp)
            other = _plus(other, outside)
        elif family == _DAMPING:
            f, f_z, f_w, outside = _damping(code, core, o, points, work.dp)
            other = _plus(other, outside)
        elif family == _FRICTION:
            f, f_w = _friction(code, core, o, points, work.dp)
        elif family == _SPRING:
            stored, stored_z = _spring(code, core, o, z, driver, work.dp)
            other, other_z = _plus(other, stored), _plus(other_z, stored_z)
        diss, diss_z, diss_w = _plus(diss, f), _plus(diss_z, f_z), _plus(diss_w, f_w)
    if changed:
        a, a_z, a_w = _changed(0, core, z[0], w[0], driver, (diss[0], diss_z[0], diss_w[0]), memory, work)
        b, b_z, b_w = _changed(1, core, z[1], w[1], driver, (diss[1], diss_z[1], diss_w[1]), memory, work)
        c, c_z, c_w = _changed(2, core, z[2], w[2], driver, (diss[2], diss_z[2], diss_w[2]), memory, work)
        diss, diss_z, diss_w = (a, b, c), (a_z, b_z, c_z), (a_w, b_w, c_w)
    return _plus(diss, other), _plus(diss_z, other_z), diss_w
