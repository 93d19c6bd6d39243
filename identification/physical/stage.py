"""One implicit stage of the mounted damper: the velocity of its core, and how that depends on every parameter."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined, pasted
from identification.physical.core import core_force
from identification.physical.elements.equations.memory import (
    BY_MEMORY,
    BY_START,
    BY_W,
    BY_W_OLD,
    BY_Z,
    OWN,
    Leg,
    advance,
    own,
    own_count,
)
from identification.physical.elements.equations.point import Point
from identification.physical.mount import GAMMA, add_mount_partials, branch, branch_partials, contact, slip
from identification.physical.program import BRANCH, MET_AT_ONCE, TOLERANCE, E, W, Z

MET = 1e-6  # of a velocity: Newton squares its error, so a step as small as this leads to round-off
_NEAR = 1e-3  # of it: what the next step leads to is worth its slopes
_FAR = 1e13  # times the tolerance of a velocity: the highest of the motion


class Stage(NamedTuple):
    """Where an implicit stage lies, and from where it starts."""

    x: float  # of the rig
    v: float
    inputs: tuple[float, float, float, float]  # u, temperature, a and v_m
    e0: float  # extension at the base of the stage
    gh: float  # duration of an implicit stage
    h: float  # duration since the last step
    b0: float  # force of the mount's relaxing branch as b0 + b1·de/dt, or of its friction at the last step
    b1: float
    last: float  # extension at the last step, from where the mount's friction starts with the force b0


class Solved(NamedTuple):
    """Velocity of the core, ∂f/∂z + ∂φ/∂e, ∂f/∂u, the slope of the equation by w (0: it sticks), and success."""

    w: float
    stiff: float
    by_u: float
    slope: float
    done: bool


class Ended(NamedTuple):
    """State at the end of a stage."""

    i: int
    q: float  # share of the sample interval
    e: float
    rate: float
    u: float
    f2: float
    gh: float


@inlined
def between(drive, i, q):
    """Displacement, velocity, and u, temperature, a and v_m at the share `q` of sample interval i.

    The displacement is the cubic through both samples and their velocities: exact there, of fourth order between.
    """
    x, v, u, dt = drive.x, drive.v, drive.u, drive.dt
    temperature, a, v_m = drive.temperature, drive.a, drive.v_m
    dx, q2, q3 = x[i + 1] - x[i], q * q, q * q * q
    xs = x[i] + (3 * q2 - 2 * q3) * dx + dt * ((q3 - 2 * q2 + q) * v[i] + (q3 - q2) * v[i + 1])
    vs = 6 * (q - q2) * dx / dt + (3 * q2 - 4 * q + 1) * v[i] + (3 * q2 - 2 * q) * v[i + 1]
    inputs = (
        u[i] + q * (u[i + 1] - u[i]),
        temperature[i] + q * (temperature[i + 1] - temperature[i]),
        a[i] + q * (a[i + 1] - a[i]),
        v_m[i] + q * (v_m[i + 1] - v_m[i]),
    )
    return xs, vs, inputs


@inlined
def _trial(core, z, w, s, stage, space, wanted):
    """Core force at a trial state, memories carried there from the last step; adds their share to the slopes."""
    work, memory, state = space.work, space.carried.memory, space.carried.state
    u, temperature, a, v_m = stage.inputs
    if core.remembers:
        leg = Leg(z - state[Z], state[W], w, stage.h, z)
        for k in range(core.codes.size):
            if core.memory[k]:
                work.trial[k] = advance(
                    core.codes[k], core.p, core.offsets[k], memory[k], leg, wanted, work.parts[k], work.leg
                )
    answer = core_force(core, Point(z, w, s, u, temperature, a, v_m), work.trial, work, wanted)
    f_z, f_w = answer.by_z, answer.by_w
    if core.remembers:
        for k in range(core.codes.size):
            if core.memory[k]:
                f_z += work.dm[k] * work.parts[k, BY_Z]
                f_w += work.dm[k] * work.parts[k, BY_W]
    return answer.f, f_z, f_w, answer.by_u, answer.jump


@inlined
def beside(mount, stage, rate):
    """Force beside the contact, of a relaxing branch or of friction, and its slopes by de/dt and e."""
    if mount.f_slip > 0.0:
        met = slip(mount, stage.b0, stage.e0 + stage.gh * rate - stage.last)
        return met.y, 0.0, met.by_e
    return stage.b0 + stage.b1 * rate, stage.b1, 0.0


@inlined
def _slides(core, mount, stage, space, wanted):
    """The side to which a core with dry friction slides, ∂f/∂u at rest, and whether friction holds it there."""
    v, e0, gh = stage.v, stage.e0, stage.gh
    f, _, _, f_u, jump = _trial(core, stage.x - e0 - gh * v, 0.0, 0.0, stage, space, wanted)
    phi = contact(mount, stage.inputs[0], e0 + gh * v, v).f
    phi += beside(mount, stage, v)[0]
    return (-1.0 if f > phi else 1.0), f_u, abs(f - phi) <= jump


@pasted
def solve(core, mount, stage, guess, space, wanted):
    """Solves one implicit stage for the velocity of the core, from a `guess` of it."""
    x, v, e0, gh = stage.x, stage.v, stage.e0, stage.gh
    state, u = space.carried.state, stage.inputs[0]
    tol = state[TOLERANCE]
    low, high, side = -np.inf, np.inf, 0.0
    w, stiff, f_u, slope, done, near = guess, 0.0, 0.0, 0.0, False, state[MET_AT_ONCE] > 0.0
    if core.jumps:
        side, f_u, done = _slides(core, mount, stage, space, wanted)
        low, high = (0.0, high) if side > 0 else (low, 0.0)
        if done:
            w = 0.0
        elif guess * side <= 0.0:
            w = side * 1e-3 * abs(v)
    iterations, last = 0, np.inf
    while not done and iterations < 80:
        iterations += 1
        rate = v - w
        s = side if side != 0.0 else (1.0 if w > 0 else -1.0)
        f, f_z, f_w, f_u, _ = _trial(core, x - e0 - gh * rate, w, s, stage, space, wanted and near)
        met_at = contact(mount, u, e0 + gh * rate, rate)
        more, more_rate, more_e = beside(mount, stage, rate)
        residual = f - met_at.f - more
        stiff = f_z + met_at.by_e + more_e
        slope = f_w + gh * stiff + met_at.by_rate + more_rate
        if residual < 0.0:
            low = w
        else:
            high = w
        step = -residual / slope if slope > 0.0 else np.inf
        bounded = high - low < np.inf
        # Asked before the bracket, which round-off would have closed on the solution itself.
        met = abs(step) <= MET * abs(w) + tol or high - low <= 1e-15 * abs(w) + tol
        done = met and (near or not wanted)
        near = met or abs(step) <= _NEAR * abs(w)
        if iterations == 1:
            state[MET_AT_ONCE] = 1.0 if met else 0.0
        inside = low < w + step < high
        # Lost as Newton is where the force jumps, or where its slope all but vanishes.
        lost = abs(step) > (0.5 * last if bounded else 2.0 * abs(w) + _FAR * tol)
        if not met and (lost or not inside):
            step = 0.5 * (low + high) - w if bounded else -np.sign(residual) * max(2.0 * abs(w), 1e3 * tol)
        if not met or inside:
            w += step
            last = abs(step)
        if done and inside:
            _follow(core, gh, step, space.work)
        slope = max(slope, 1e-300)
    return Solved(w, stiff, f_u, slope, done)


@inlined
def _follow(core, gh, shift, work):
    """Takes the memories along with the last step of the velocity, a small one."""
    if core.remembers:
        for k in range(core.codes.size):
            if core.memory[k]:
                work.trial[k] += (gh * work.parts[k, BY_Z] + work.parts[k, BY_W]) * shift


@pasted
def rate_sensitivity(core, drive, mounting, ended, solved, space):
    """∂(de/dt)/∂θ of one stage by the implicit function theorem, into `stages.rate`; zero where the core sticks."""
    mount, mount_column = mounting
    i, q, e, rate, u, f2, gh = ended
    work, stages, out = space.work, space.stages, space.stages.rate
    inverse = 1.0 / solved.slope if solved.slope > 0.0 else 0.0
    for j in range(out.size):
        out[j] = -solved.stiff * stages.base[j]
    for j in range(core.p.size):
        if core.column[j] >= 0:
            out[core.column[j]] += work.dp[j]
    for j in range(drive.du.shape[0]):
        du = drive.du[j, i] + q * (drive.du[j, i + 1] - drive.du[j, i])
        out[j] += (solved.by_u - mount.c_control * rate) * du
    if core.remembers:
        _add_memories(out, core, space)
    add_mount_partials(out, mounting, e, rate, u, -1.0)
    if mount.f_slip > 0.0:
        _add_slip(out, core, mounting, e, space)
    if mount.k2 > 0.0:
        by_f2, by_k2, by_c2 = branch_partials(mount, f2, gh, rate)
        for j in range(out.size):
            out[j] -= by_f2 * stages.branch[j]
        if mount_column.k2 >= 0:
            out[mount_column.k2] -= by_k2
        if mount_column.c2 >= 0:
            out[mount_column.c2] -= by_c2
    for j in range(out.size):
        out[j] *= inverse


@compiled
def _add_slip(out, core, mounting, e, space):
    """Takes off what the mount's friction at the extension `e` owes to the last step and to its own parameters."""
    (mount, column), state = mounting, space.carried.state
    sens, de = space.carried.sens[core.codes.size], space.carried.de
    met = slip(mount, state[BRANCH], e - state[E])
    for j in range(out.size):
        out[j] -= met.by_y * sens[j] - met.by_e * de[j]
    if column.k_slip >= 0:
        out[column.k_slip] -= met.by_k
    if column.f_slip >= 0:
        out[column.f_slip] -= met.by_f


@compiled
def slip_sensitivity(core, mounting, e, space):
    """Carries the sensitivity of the mount's friction over a step that ends at the extension `e`."""
    (mount, column), state = mounting, space.carried.state
    sens, de, de_new = space.carried.sens[core.codes.size], space.carried.de, space.stages.base
    met = slip(mount, state[BRANCH], e - state[E])
    for j in range(de.size):
        sens[j] = met.by_y * sens[j] + met.by_e * (de_new[j] - de[j])
    if column.k_slip >= 0:
        sens[column.k_slip] += met.by_k
    if column.f_slip >= 0:
        sens[column.f_slip] += met.by_f


@inlined
def _add_memories(out, core, space):
    """Adds what the force owes to the memories at the last step and to their own parameters."""
    work, sens, de = space.work, space.carried.sens, space.carried.de
    parts, dm, last = work.parts, work.dm, core.codes.size + 1
    for k in range(core.codes.size):
        if core.memory[k]:
            first = own(core.codes[k], core.offsets[k])
            for j in range(out.size):  # the leg began at z_old, which moved by −de
                by_start = parts[k, BY_Z] - parts[k, BY_START]
                out[j] += dm[k] * (parts[k, BY_MEMORY] * sens[k, j] + by_start * de[j])
                out[j] += dm[k] * parts[k, BY_W_OLD] * sens[last, j]
            for j in range(own_count(core.codes[k])):
                if core.column[first + j] >= 0:
                    out[core.column[first + j]] += dm[k] * parts[k, OWN + j]


@compiled
def carry(core, space):
    """Sensitivities of the memories after a step in which the core moved by the change of −e to a velocity v − r."""
    sens, de, de_new = space.carried.sens, space.carried.de, space.stages.base
    rate, parts, last = space.stages.rate, space.work.parts, core.codes.size + 1
    for k in range(core.codes.size):
        if core.memory[k]:
            first = own(core.codes[k], core.offsets[k])
            for j in range(de.size):
                sens[k, j] = parts[k, BY_MEMORY] * sens[k, j] + parts[k, BY_Z] * (de[j] - de_new[j])
                sens[k, j] -= parts[k, BY_START] * de[j]
                sens[k, j] += parts[k, BY_W_OLD] * sens[last, j] - parts[k, BY_W] * rate[j]
            for j in range(own_count(core.codes[k])):
                if core.column[first + j] >= 0:
                    sens[k, core.column[first + j]] += parts[k, OWN + j]
    for j in range(de.size):
        sens[last, j] = -rate[j]


@compiled
def branch_sensitivity(mounting, ended, space, last):
    """Carries the sensitivity of the relaxing branch over a stage, to the base of the next one or to the step's end."""
    mount, column = mounting
    f2_sens, f2_base = space.carried.sens[space.carried.memory.size], space.stages.branch
    rate = space.stages.rate
    by_f2, by_k2, by_c2 = branch_partials(mount, ended.f2, ended.gh, ended.rate)
    _, b1 = branch(mount, 0.0, ended.gh)
    ahead = (1.0 - GAMMA) / GAMMA
    for j in range(rate.size):
        new = by_f2 * f2_base[j] + b1 * rate[j]
        if j == column.k2:
            new += by_k2
        if j == column.c2:
            new += by_c2
        if last:
            f2_sens[j] = new
        else:
            f2_base[j] = f2_sens[j] + ahead * (new - f2_sens[j])
