"""One step of a hysteresis behind a dashpot by the classical Runge–Kutta method, of fourth order.

Where the core is linear in its velocity, that follows at once from the extension of the mount e and the memory h,

    f_core(x − e, v − r, h) = k e + c r,   de/dt = r,   dh/dt = g(w, h),   w = v − r,

and no equation has to be solved (Spencer, Dyke, Sain & Carlson 1997 is such a model). Where that is stiff the caller
takes the step by an implicit method. The sensitivities are those of these very stages.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

from identification.compiled import compiled, inlined, pasted
from identification.physical.core import core_force
from identification.physical.elements.equations.memory import add_rate_partials, fading_rate, rate
from identification.physical.elements.equations.point import Force, Point
from identification.physical.mount import add_mount_partials
from identification.physical.program import CHANGE, EXPECTED, FIRST_RATE, RATE, E, W, Z
from identification.physical.stage import between

_AHEAD, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
_PART = 0.5  # of the travel in which the memory fades by e: the longest step
_MOST = 8  # such steps in one; of more the memory keeps nothing, and the implicit step knows that
_STIFF = 1.0  # rate of the extension times the step, beyond which the implicit step is the better one


class _Found(NamedTuple):
    """What was found at one stage: where it lies, the state there, and the slopes of the memory's rate."""

    i: int
    q: float
    ahead: float
    e: float
    r: float
    w: float
    u: float
    inverse: float  # of the slope of the force balance by w
    by_w: float
    by_h: float
    pull: float  # h |h|^(n−1)
    answer: Force


@compiled
def explicit_memory(core, mount):
    """Index of the memory that `explicit` may integrate behind this mount, −1 of none, and its rate of fading, 1/m."""
    spring = mount.k2 == 0.0 and mount.gap == 0.0 and mount.air == 0.0 and mount.f_slip == 0.0
    if core.only >= 0 and mount.c > 0.0 and spring:
        return core.only, fading_rate(core.p, core.offsets[core.only])
    return -1, 0.0


@inlined
def _solved(core, mount, at_stage, es, w, work, wanted):
    """Velocity of the core at a stage: at once, as the force is linear in it; and the core's force there.

    `at_stage` are x, v and the inputs of the stage; the partials are wanted at the velocity that the first pass finds.
    """
    x, vs, inputs = at_stage
    u, temperature, a, v_m = inputs
    c = mount.c + mount.c_control * u
    inverse = 0.0
    answer = core_force(core, Point(x - es, w, 0.0, u, temperature, a, v_m), work.trial, work, wanted)
    inverse = 1.0 / (answer.by_w + c)
    w += (mount.k * es + c * (vs - w) - answer.f) * inverse
    if wanted:
        answer = core_force(core, Point(x - es, w, 0.0, u, temperature, a, v_m), work.trial, work, wanted)
        inverse = 1.0 / (answer.by_w + c)
        w += (mount.k * es + c * (vs - w) - answer.f) * inverse
    return w, answer, inverse


@inlined
def _stage_sensitivity(core, drive, mounting, found, space, nodes):
    """Sensitivities of de/dt and of the memory's rate at one stage, into `stages.rate` and the last of `nodes.rows`."""
    i, q, ahead, r, inverse, answer = found.i, found.q, found.ahead, found.r, found.inverse, found.answer
    k, column = core.only, core.column
    o, h = core.offsets[k], space.work.trial[k]
    de, sens, dr, dg = space.carried.de, space.carried.sens, space.stages.rate, nodes.rows[2]
    mount, dm = mounting[0], space.work.dm[k]
    for j in range(de.size):
        by_m = sens[k, j] + ahead * dg[j]
        dr[j] = dm * by_m - (answer.by_z + mount.k) * (de[j] + ahead * dr[j])
        dg[j] = found.by_h * by_m
    for j in range(core.p.size):
        if column[j] >= 0:
            dr[column[j]] += space.work.dp[j]
    add_rate_partials(dg, column, core.p, o, found.w, h, found.pull)
    for j in range(drive.du.shape[0]):
        dr[j] += (answer.by_u - mount.c_control * r) * (drive.du[j, i] + q * (drive.du[j, i + 1] - drive.du[j, i]))
    add_mount_partials(dr, mounting, found.e, r, found.u, -1.0)
    for j in range(de.size):
        dr[j] *= inverse
        dg[j] -= found.by_w * dr[j]


@inlined
def _sum(space, nodes, weight, first):
    """Adds the sensitivities of a stage to those of the step."""
    dr, dg, sum_r, sum_g = space.stages.rate, nodes.rows[2], nodes.rows[0], nodes.rows[1]
    for j in range(dr.size):
        sum_r[j] = (0.0 if first else sum_r[j]) + weight * dr[j]
        sum_g[j] = (0.0 if first else sum_g[j]) + weight * dg[j]


@pasted
def explicit(core, drive, mounting, at, fade, space, nodes, wanted):
    """A step as `mounted._step` takes it; returns whether it was taken, and leaves all as it was where it was not.

    `fade` is the rate of `explicit_memory`.
    """
    i, sub, substeps = at
    mount, state, memory, only = mounting[0], space.carried.state, space.carried.memory, core.only
    trial, de, sens = space.work.trial, space.carried.de, space.carried.sens
    h = drive.dt / substeps
    parts = 1 + int(min(h * fade / _PART * max(abs(state[W]), abs(drive.v[i + 1])), _MOST))
    taken, step = parts <= _MOST, h / parts
    e, w, m, r, x = state[E], state[W], memory[only], 0.0, 0.0
    for part in range(parts + 1 if taken else 0):
        g, total_r, total_g = 0.0, 0.0, 0.0
        for stage in range(4 if part < parts else 1):  # the first of the step that would follow is the end of this one
            q = (sub + (part + _AHEAD[stage]) / parts) / substeps
            x, vs, inputs = between(drive, i, q)
            ahead, weight = _AHEAD[stage] * step, _WEIGHTS[stage] * step
            es, trial[only] = e + ahead * r, m + ahead * g
            w, answer, inverse = _solved(core, mount, (x, vs, inputs), es, w, space.work, wanted)
            r = vs - w
            g, by_w, by_h, pull = rate(core.p, core.offsets[only], w, trial[only])
            if part == 0 and stage == 0:
                stiff = mount.k + abs(answer.by_z) + abs(space.work.dm[only] * by_w)
                taken = inverse > 0.0 and stiff * inverse * step <= _STIFF
                if not taken:
                    break
            total_r, total_g = total_r + weight * r, total_g + weight * g
            if wanted:
                found = _Found(i, q, ahead, es, r, w, inputs[0], inverse, by_w, by_h, pull, answer)
                _stage_sensitivity(core, drive, mounting, found, space, nodes)
                _sum(space, nodes, weight, stage == 0)
        if taken and part < parts:
            e, m = e + total_r, m + total_g
            for j in range(de.size if wanted else 0):
                de[j] += nodes.rows[0, j]
                sens[only, j] += nodes.rows[1, j]
        elif not taken:
            break
    if taken:
        memory[only] = m
        state[E], state[Z], state[W], state[RATE] = e, x - e, w, r
        state[EXPECTED], state[FIRST_RATE], state[CHANGE] = r, r, 0.0
        for j in range(de.size if wanted else 0):
            sens[core.codes.size + 1, j] = -space.stages.rate[j]
    return taken
