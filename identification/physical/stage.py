"""One implicit stage of the mounted damper: the velocity of its core, and how that depends on every parameter."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import compiled, inlined, pasted
from identification.physical.core import core_force
from identification.physical.memory import (
    BY_MEMORY,
    BY_W,
    BY_W_OLD,
    BY_Z,
    OWN,
    advance,
    is_memory,
    own,
    own_count,
)
from identification.physical.mount import (
    C2,
    C_CONTROL,
    GAMMA,
    GAP,
    K2,
    C,
    K,
    add_mount_partials,
    branch,
    branch_partials,
    contact,
)

MET = 1e-6  # of a velocity: Newton squares its error, so a step as small as this leads to round-off
_NEAR = 1e-3  # of it: what the next step leads to is worth its slopes
_FAR = 1e13  # times the tolerance of a velocity: the highest of the motion


@inlined
def between(motion, i, q):
    """Displacement, velocity, and u, temperature, a and v_m at the share `q` of sample interval i.

    The displacement is the cubic through both samples and their velocities: exact there, of fourth order between.
    """
    x, v, u, temperature, a, v_m, dt = motion
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
def _trial(program, z, w, s, h, inputs, state, memory, work, wanted):
    """Core force at a trial state, memories carried there from the last step; adds their share to ∂f/∂z."""
    codes, offsets, p, modified, remembers, rare = (
        program[0],
        program[1],
        program[2],
        program[4],
        program[5],
        program[7],
    )
    trial, parts, tmp, dp, dm = work
    u, temperature, a, v_m = inputs
    if remembers:
        for k in range(codes.size):
            if is_memory(codes[k]):
                trial[k] = advance(
                    codes[k], p, offsets[k], memory[k], state[1], z, state[2], w, h, wanted, parts[k], tmp
                )
    f, f_z, f_w, f_u, jump = core_force(
        codes, offsets, p, z, w, s, u, temperature, a, v_m, trial, dp, dm, modified, rare, wanted
    )
    if remembers:
        for k in range(codes.size):
            if is_memory(codes[k]):
                f_z += dm[k] * parts[k, BY_Z]
                f_w += dm[k] * parts[k, BY_W]
    return f, f_z, f_w, f_u, jump


@pasted
def solve(program, mount, x, v, inputs, e0, gh, h, b0, b1, guess, state, memory, work, wanted):
    """Velocity of the core at one implicit stage, from a `guess` of it.

    `inputs` are u, temperature, a and v_m; `b0 + b1·de/dt` is the force of the mount's relaxing branch.
    Returns w, ∂f/∂z + ∂φ/∂e, ∂f/∂u, the slope of the equation by w, and whether it converged; a slope of 0 means stick.
    """
    km, cm, gap, tol = mount[K], mount[C] + mount[C_CONTROL] * inputs[0], mount[GAP], state[4]
    low, high, side = -np.inf, np.inf, 0.0
    w, stiff, f_u, slope, done, near = guess, 0.0, 0.0, 0.0, False, state[9] > 0.0
    if program[6]:  # dry friction: does it hold the core at rest?
        f, _, _, f_u, jump = _trial(program, x - e0 - gh * v, 0.0, 0.0, h, inputs, state, memory, work, wanted)
        phi, _, _, _, _, _ = contact(km, cm, gap, e0 + gh * v, v)
        phi += b0 + b1 * v
        side = -1.0 if f > phi else 1.0
        done = abs(f - phi) <= jump
        if side > 0:
            low = 0.0
        else:
            high = 0.0
        if done:
            w = 0.0
        elif guess * side <= 0.0:
            w = side * 1e-3 * abs(v)
    iterations, last = 0, np.inf
    while not done and iterations < 80:
        iterations += 1
        rate = v - w
        s = side if side != 0.0 else (1.0 if w > 0 else -1.0)
        f, f_z, f_w, f_u, _ = _trial(program, x - e0 - gh * rate, w, s, h, inputs, state, memory, work, wanted and near)
        phi, phi_e, phi_r, _, _, _ = contact(km, cm, gap, e0 + gh * rate, rate)
        residual = f - phi - (b0 + b1 * rate)
        stiff = f_z + phi_e
        slope = f_w + gh * stiff + phi_r + b1
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
            state[9] = 1.0 if met else 0.0
        inside = low < w + step < high
        # Lost as Newton is where the force jumps, or where its slope all but vanishes.
        lost = abs(step) > (0.5 * last if bounded else 2.0 * abs(w) + _FAR * tol)
        if not met and (lost or not inside):
            step = 0.5 * (low + high) - w if bounded else -np.sign(residual) * max(2.0 * abs(w), 1e3 * tol)
        if not met or inside:
            w += step
            last = abs(step)
        if done and inside:
            _follow(program, gh, step, work)
        slope = max(slope, 1e-300)
    return w, stiff, f_u, slope, done


@inlined
def _follow(program, gh, shift, work):
    """Takes the memories along with the last step of the velocity, a small one."""
    trial, parts = work[0], work[1]
    if program[5]:
        for k in range(trial.size):
            if is_memory(program[0][k]):
                trial[k] += (gh * parts[k, BY_Z] + parts[k, BY_W]) * shift


@pasted
def rate_sensitivity(
    program, mount, mount_column, e, rate, u, stiff, f_u, slope, de, de_base, f2, f2_base, gh, du, i, q, sens, work, out
):  # fmt: skip
    """∂(de/dt)/∂θ of one stage by the implicit function theorem; zero where the core sticks."""
    inverse = 1.0 / slope if slope > 0.0 else 0.0
    codes, offsets, p, column = program[0], program[1], program[2], program[3]
    parts, dp, dm = work[1], work[3], work[4]
    for j in range(out.size):
        out[j] = -stiff * de_base[j]
    for j in range(p.size):
        if column[j] >= 0:
            out[column[j]] += dp[j]
    for j in range(du.shape[0]):
        out[j] += (f_u - mount[C_CONTROL] * rate) * (du[j, i] + q * (du[j, i + 1] - du[j, i]))
    if program[5]:
        for k in range(codes.size):
            if is_memory(codes[k]):
                first = own(codes[k], offsets[k])
                for j in range(out.size):  # the leg began at z_old, which moved by −de
                    out[j] += dm[k] * (parts[k, BY_MEMORY] * sens[k, j] + parts[k, BY_Z] * de[j])
                    out[j] += dm[k] * parts[k, BY_W_OLD] * sens[codes.size + 1, j]
                for j in range(own_count(codes[k])):
                    if column[first + j] >= 0:
                        out[column[first + j]] += dm[k] * parts[k, OWN + j]
    add_mount_partials(out, mount_column, e, rate, u, mount, -1.0)
    if mount[K2] > 0.0:
        by_f2, by_k2, by_c2 = branch_partials(mount, f2, gh, rate)
        for j in range(out.size):
            out[j] -= by_f2 * f2_base[j]
        if mount_column[K2] >= 0:
            out[mount_column[K2]] -= by_k2
        if mount_column[C2] >= 0:
            out[mount_column[C2]] -= by_c2
    for j in range(out.size):
        out[j] *= inverse


@compiled
def carry(program, sens, de, de_new, rate_sens, parts):
    """Sensitivities of the memories after a step in which the core moved by the change of −e to a velocity v − r."""
    codes, offsets, column = program[0], program[1], program[3]
    for k in range(codes.size):
        if is_memory(codes[k]):
            first = own(codes[k], offsets[k])
            for j in range(de.size):
                sens[k, j] = parts[k, BY_MEMORY] * sens[k, j] + parts[k, BY_Z] * (de[j] - de_new[j])
                sens[k, j] += parts[k, BY_W_OLD] * sens[codes.size + 1, j] - parts[k, BY_W] * rate_sens[j]
            for j in range(own_count(codes[k])):
                if column[first + j] >= 0:
                    sens[k, column[first + j]] += parts[k, OWN + j]
    for j in range(de.size):
        sens[codes.size + 1, j] = -rate_sens[j]


@compiled
def branch_sensitivity(mount, mount_column, f2, gh, rate, rate_sens, f2_base, f2_sens, last):
    """Carries the sensitivity of the relaxing branch over a stage, to the base of the next one or to the step's end."""
    by_f2, by_k2, by_c2 = branch_partials(mount, f2, gh, rate)
    _, b1 = branch(mount, 0.0, gh)
    ahead = (1.0 - GAMMA) / GAMMA
    for j in range(rate_sens.size):
        new = by_f2 * f2_base[j] + b1 * rate_sens[j]
        if j == mount_column[K2]:
            new += by_k2
        if j == mount_column[C2]:
            new += by_c2
        if last:
            f2_sens[j] = new
        else:
            f2_base[j] = f2_sens[j] + ahead * (new - f2_sens[j])
