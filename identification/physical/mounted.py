"""The time loop of a damper behind a mount of stiffness k, damping c and gap, with exact forward sensitivities.

The unknown is the extension of the mount e = x − z, and each step solves

    f_core(x − e, v − de/dt) = φ(e, de/dt)

by the Radau IIA of `collocation.py` where the core is smooth, explicitly (`explicit.py`) where it is a Bouc–Wen
hysteresis behind a dashpot, else by the two-stage L-stable SDIRK2 of Alexander (1977), γ = 1 − 1/√2, whose equation has
one unknown that can be bracketed. Only the small extension is discretised, never the motion itself, so that a stiff
mount costs no accuracy. Dry friction is solved as the inclusion it is: first the question whether the joint sticks,
then a smooth monotone equation on the side on which it slips.

Sensitivities follow from the implicit function theorem on the discrete equations, so they are the gradient of what is
computed rather than of what was meant.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.collocation import collocate, prepare
from identification.physical.compiled import compiled, inlined, pasted
from identification.physical.core import has_rare
from identification.physical.elements import Code
from identification.physical.explicit import explicit, explicit_memory
from identification.physical.memory import is_memory, steady
from identification.physical.modifiers import has_modifier
from identification.physical.mount import C_CONTROL, GAMMA, GAP, K2, C, K, add_mount_partials, branch, contact
from identification.physical.stage import between, branch_sensitivity, carry, rate_sensitivity, solve

_COULOMB, _STRIBECK, _VISCOUS = int(Code.COULOMB), int(Code.STRIBECK), int(Code.VISCOUS)
_BY_SPEED = (int(Code.ARCTAN), int(Code.PIECEWISE), int(Code.QUADRATIC), int(Code.RELIEF), int(Code.ASYMMETRY))


@inlined
def _copy(to, source):
    """Element by element: slice assignment costs more than a step of the solver."""
    for j in range(to.size):
        to[j] = source[j]


@compiled
def _keep(memory, sens, de, state, to_memory, to_sens, to_de, to_state):
    _copy(to_memory, memory)
    for k in range(sens.shape[0]):
        for j in range(sens.shape[1]):
            to_sens[k, j] = sens[k, j]
    _copy(to_de, de)
    _copy(to_state, state)


@pasted
def _step(program, mount, mount_column, motion, i, sub, substeps, state, memory, du, sens, de, work, grads, wanted):
    """One SDIRK2 step from (sub)/substeps to (sub + 1)/substeps of sample interval i; returns whether it converged.

    state : e, z and w at the last step, de/dt to expect at the first stage of the next, the tolerance of w, de/dt and
    the branch's force at the end, de/dt at the first stage and its change from there to the end, and whether the last
    stage was met at the first guess.
    """
    dt = motion[6]
    de_base, rate_sens, f2_base = grads
    h = dt / substeps
    gh = GAMMA * h
    e0, e, rate, z, w, f2, converged = state[0], 0.0, 0.0, 0.0, 0.0, 0.0, True
    f2_start = state[6]
    relaxes = mount[K2] > 0.0
    expected = state[3]
    _copy(de_base, de)
    if relaxes and wanted:
        _copy(f2_base, sens[memory.size])
    for stage in range(2):
        part = GAMMA if stage == 0 else 1.0
        q = (sub + part) / substeps
        xs, vs, inputs = between(motion, i, q)
        b0, b1 = branch(mount, f2_start, gh)
        w, stiff, f_u, slope, ok = solve(
            program, mount, xs, vs, inputs, e0, gh, h * part, b0, b1, vs - expected, state, memory, work, wanted
        )
        converged = converged and ok
        rate = vs - w
        e = e0 + gh * rate
        f2 = b0 + b1 * rate
        if wanted:
            rate_sensitivity(
                program, mount, mount_column, e, rate, inputs[0], stiff, f_u, slope, de, de_base, f2, f2_base, gh, du,
                i, q, sens, work, rate_sens,
            )  # fmt: skip
            if relaxes:
                row = sens[memory.size]
                branch_sensitivity(mount, mount_column, f2, gh, rate, rate_sens, f2_base, row, stage == 1)
        if stage == 0:
            expected = rate + state[8]
            state[3], state[7] = 2.0 * rate - state[7], rate
            e0 += (1.0 - GAMMA) * h * rate
            f2_start += (1.0 - GAMMA) / GAMMA * (f2 - f2_start)
            for j in range(de.size if wanted else 0):
                de_base[j] += (1.0 - GAMMA) * h * rate_sens[j]
        z = xs - e
    if wanted:
        for j in range(de.size):
            de_base[j] += gh * rate_sens[j]
        carry(program, sens, de, de_base, rate_sens, work[1])
        _copy(de, de_base)
    if program[5]:
        _copy(memory, work[0])
    state[0], state[1], state[2], state[5], state[6], state[8] = e, z, w, rate, f2, rate - state[7]
    return converged


@compiled
def mounted(
    codes, offsets, p, column, dt, inputs, du, mount, mount_column, substeps, fine, force, jac, space
):  # fmt: skip
    """Force through a series mount: arguments as in `rigid`.

    mount : (6,) float64: k in N/m, c in N·s/m, gap in m, k2 in N/m and c2 in N·s/m of a relaxing branch, c by ampere.
    mount_column : (6,) their columns of `jac`, −1 where none is wanted.
    substeps : steps to a sample; `fine` of them where a contact opens or closes or a memory meets a reversal.
    Returns the number of steps whose equation did not converge.
    """
    x, v, u, temperature, a, v_m = inputs
    n_col = jac.shape[1]
    wanted = jac.shape[0] > 0
    has_jump, remembers = False, False
    for k in range(codes.size):
        o = offsets[k]
        has_jump = has_jump or (codes[k] == _COULOMB and p[o + 1] == 0.0) or (codes[k] == _STRIBECK and p[o + 3] == 0.0)
        remembers = remembers or is_memory(codes[k])
    smooth = not (has_jump or remembers or mount[GAP] > 0.0)
    driven = 1 if wanted or mount[C_CONTROL] != 0.0 else 0
    for k in range(codes.size):
        if not (codes[k] in _BY_SPEED or (codes[k] == _VISCOUS and p[offsets[k] + 1] == 0.0)):
            driven = 1
    modified, rare = has_modifier(codes), has_rare(codes)
    driven = 2 if modified or rare else driven
    program = (codes, offsets, p, column, modified, remembers, has_jump, rare, driven)
    motion = (x, v, u, temperature, a, v_m, dt)
    memory, sens, de, state, kept, work, grads, nodes = space
    prepare(mount, dt, substeps, nodes)
    rate = nodes[5]
    only, fade = explicit_memory(codes, offsets, p, mount)
    top = 1e-300
    for i in range(v.size):
        top = max(top, abs(v[i]))
    state[1], state[2], state[4] = x[0], v[0], 1e-13 * top
    failures = 0
    steady(codes, offsets, p, column, v[0], x, memory, sens)
    for i in range(x.size - 1):
        steps, again = substeps, True
        touching = abs(state[0]) > 0.5 * mount[GAP]
        if fine > substeps:
            _keep(memory, sens, de, state, kept[0], kept[1], kept[2], kept[3])
        while again:
            for sub in range(steps):
                if smooth and collocate(
                    program, mount, mount_column, motion, i, sub, state, du, sens, de, work, grads, nodes, wanted
                ):
                    continue
                if only >= 0 and explicit(
                    program, mount, mount_column, motion, i, sub, steps, only, fade, state, memory, du, sens, de, work,
                    grads, nodes[8], wanted,
                ):  # fmt: skip
                    continue
                if not _step(program, mount, mount_column, motion, i, sub, steps, state, memory, du, sens, de, work,
                             grads, wanted):  # fmt: skip
                    failures += 1
                rate[0], rate[1], rate[2] = state[5], state[5], state[5]
            again = False
            if fine > steps:
                impact = (abs(state[0]) > 0.5 * mount[GAP]) != touching
                turned = remembers and kept[3][2] * state[2] < 0.0
                if impact or turned:
                    _keep(kept[0], kept[1], kept[2], kept[3], memory, sens, de, state)
                    steps, again = fine, True
        cm = mount[C] + mount[C_CONTROL] * u[i + 1]
        phi, phi_e, phi_r, _, _, _ = contact(mount[K], cm, mount[GAP], state[0], state[5])
        force[i + 1] = phi + state[6]
        if not abs(force[i + 1]) < np.inf:  # nothing comes of what ran away, and each step of it takes all iterations
            force[i + 1 :] = np.nan
            break
        if wanted:
            row = jac[i + 1]
            for j in range(n_col):
                row[j] = phi_e * de[j] + phi_r * grads[1][j] + sens[codes.size, j]
            for j in range(du.shape[0]):
                row[j] += mount[C_CONTROL] * state[5] * du[j, i + 1]
            add_mount_partials(row, mount_column, state[0], state[5], u[i + 1], mount, 1.0)
    # The first sample is a convention (no extension, no history): its neighbour stands for it.
    force[0] = force[1]
    for j in range(n_col if wanted else 0):
        jac[0, j] = jac[1, j]
    return failures
