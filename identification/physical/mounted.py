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

from typing import NamedTuple

import numpy as np

from identification.compiled import compiled, inlined, pasted
from identification.physical.collocation import collocate, prepare
from identification.physical.elements.equations.memory import highest, steady
from identification.physical.explicit import explicit, explicit_memory
from identification.physical.mount import GAMMA, add_mount_partials, branch, contact
from identification.physical.program import (
    BRANCH,
    CHANGE,
    EXPECTED,
    FIRST_RATE,
    RATE,
    TOLERANCE,
    E,
    W,
    Z,
)
from identification.physical.stage import (
    Ended,
    Stage,
    beside,
    between,
    branch_sensitivity,
    carry,
    rate_sensitivity,
    slip_sensitivity,
    solve,
)


class Place(NamedTuple):
    """A step of the solver: from (sub)/substeps to (sub + 1)/substeps of sample interval i."""

    i: int
    sub: int
    substeps: int


@inlined
def _copy(to, source):
    """Element by element: slice assignment costs more than a step of the solver."""
    for j in range(to.size):
        to[j] = source[j]


@compiled
def _keep(source, to):
    _copy(to.memory, source.memory)
    for k in range(source.sens.shape[0]):
        for j in range(source.sens.shape[1]):
            to.sens[k, j] = source.sens[k, j]
    _copy(to.de, source.de)
    _copy(to.state, source.state)


@pasted
def _step(core, drive, mounting, at, space, wanted):
    """One SDIRK2 step; returns whether it converged."""
    i, sub, substeps = at
    mount, state, stages = mounting[0], space.carried.state, space.stages
    h = drive.dt / substeps
    gh = GAMMA * h
    e0, e, rate, z, w, f2, converged = state[E], 0.0, 0.0, 0.0, 0.0, 0.0, True
    f2_start, expected = state[BRANCH], state[EXPECTED]
    relaxes, slips = mount.k2 > 0.0, mount.f_slip > 0.0
    _copy(stages.base, space.carried.de)
    if relaxes and wanted:
        _copy(stages.branch, space.carried.sens[core.codes.size])
    for stage in range(2):
        part = GAMMA if stage == 0 else 1.0
        q = (sub + part) / substeps
        xs, vs, inputs = between(drive, i, q)
        b0, b1 = branch(mount, f2_start, gh)
        here = Stage(xs, vs, inputs, e0, gh, h * part, state[BRANCH] if slips else b0, b1, state[E])
        found = solve(core, mount, here, vs - expected, space, wanted)
        converged = converged and found.done
        w = found.w
        rate = vs - w
        e = e0 + gh * rate
        f2 = beside(mount, here, rate)[0]
        if wanted:
            ended = Ended(i, q, e, rate, inputs[0], f2, gh)
            rate_sensitivity(core, drive, mounting, ended, found, space)
            if relaxes:
                branch_sensitivity(mounting, ended, space, stage == 1)
        if stage == 0:
            expected = rate + state[CHANGE]
            state[EXPECTED], state[FIRST_RATE] = 2.0 * rate - state[FIRST_RATE], rate
            e0 += (1.0 - GAMMA) * h * rate
            f2_start += (1.0 - GAMMA) / GAMMA * (f2 - f2_start)
            for j in range(stages.base.size if wanted else 0):
                stages.base[j] += (1.0 - GAMMA) * h * stages.rate[j]
        z = xs - e
    if wanted:
        for j in range(stages.base.size):
            stages.base[j] += gh * stages.rate[j]
        carry(core, space)
        if slips:
            slip_sensitivity(core, mounting, e, space)
        _copy(space.carried.de, stages.base)
    if core.remembers:
        _copy(space.carried.memory, space.work.trial)
    state[E], state[Z], state[W], state[RATE], state[BRANCH] = e, z, w, rate, f2
    state[CHANGE] = rate - state[FIRST_RATE]
    return converged


@inlined
def _write_row(row, core, drive, mounting, i, space):
    """Gradient of the force at sample i."""
    mount, state, sens, du = mounting[0], space.carried.state, space.carried.sens, drive.du
    met = contact(mount, drive.u[i], state[E], state[RATE])
    for j in range(row.size):
        row[j] = met.by_e * space.carried.de[j] + met.by_rate * space.stages.rate[j] + sens[core.codes.size, j]
    for j in range(du.shape[0]):
        row[j] += mount.c_control * state[RATE] * du[j, i]
    add_mount_partials(row, mounting, state[E], state[RATE], drive.u[i], 1.0)


@compiled
def mounted(core, drive, mounting, begin, force, jac, space, nodes):
    """Force of a `Core` along a `Drive` through a series mount: `force`, `jac` and `space` as in `rigid`.

    mounting : a `Mount`, and another one with the columns of `jac`, −1 where none is wanted.
    begin : steps to a sample; so many where a contact opens or closes or a memory meets a reversal; whether it begins
    at rest in `space`, else where the last run with `space` and `nodes` ended, at the first sample.
    nodes : the `Nodes` of the collocation.
    Returns the number of steps whose equation did not converge.
    """
    mount, carried, kept = mounting[0], space.carried, space.kept
    state, rate = carried.state, nodes.rate
    few, fine, fresh = begin
    wanted = jac.shape[0] > 0
    smooth = not (core.jumps or core.remembers or mount.gap > 0.0 or mount.air > 0.0 or mount.f_slip > 0.0)
    prepare(mount, drive.dt, few, nodes)
    only, fade = explicit_memory(core, mount)
    failures = 0
    if fresh:
        state[Z], state[W], state[TOLERANCE] = drive.x[0], drive.v[0], 1e-13 * highest(drive.v)
        steady(core, drive.v, drive.x, carried.memory, carried.sens)
    for i in range(drive.x.size - 1):
        steps, again = few, True
        touching = abs(state[E]) > 0.5 * mount.gap
        if fine > few:
            _keep(carried, kept)
        while again:
            for sub in range(steps):
                at = Place(i, sub, steps)
                if smooth and collocate(core, drive, mounting, at, space, nodes, wanted):
                    continue
                if only >= 0 and explicit(core, drive, mounting, at, fade, space, nodes, wanted):
                    continue
                if not _step(core, drive, mounting, at, space, wanted):
                    failures += 1
                rate[0], rate[1], rate[2] = state[RATE], state[RATE], state[RATE]
            again = False
            if fine > steps:
                impact = (abs(state[E]) > 0.5 * mount.gap) != touching
                turned = core.remembers and kept.state[W] * state[W] < 0.0
                turned |= mount.f_slip > 0.0 and kept.state[RATE] * state[RATE] < 0.0
                if impact or turned:
                    _keep(kept, carried)
                    steps, again = fine, True
        force[i + 1] = contact(mount, drive.u[i + 1], state[E], state[RATE]).f + state[BRANCH]
        if not abs(force[i + 1]) < np.inf:  # nothing comes of what ran away, and each step of it takes all iterations
            force[i + 1 :] = np.nan
            break
        if wanted:
            _write_row(jac[i + 1], core, drive, mounting, i + 1, space)
    # The first sample is a convention (no extension, no history): its neighbour stands for it.
    force[0] = force[1]
    for j in range(jac.shape[1] if wanted else 0):
        jac[0, j] = jac[1, j]
    return failures
