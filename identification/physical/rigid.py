"""The time loop of a damper that is bolted to the rig: z = x and w = v, every sample is one evaluation."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled, inlined
from identification.physical.core import core_force
from identification.physical.elements.equations.memory import BY_MEMORY, OWN, Leg, advance, own, own_count, steady
from identification.physical.elements.equations.point import Point


@inlined
def sign(w, eps):
    """Sign of a velocity; within round-off of rest it is neither."""
    if w > eps:
        return 1.0
    if w < -eps:
        return -1.0
    return 0.0


@inlined
def _leg(drive, i):
    """From sample i − 1 to sample i."""
    return Leg(drive.x[i] - drive.x[i - 1], drive.v[i - 1], drive.v[i], drive.dt, drive.x[i])


@inlined
def _carry_memories(core, drive, i, space):
    """Takes the memories from sample i − 1 to sample i."""
    memory, leg = space.carried.memory, _leg(drive, i)
    for k in range(core.codes.size):
        if core.memory[k]:
            code, o = core.codes[k], core.offsets[k]
            memory[k] = advance(code, core.p, o, memory[k], leg, False, space.work.parts[0], space.work.leg)


@inlined
def _carry_sensitivities(core, drive, i, space):
    """The same, with the sensitivities of the memories."""
    memory, sens, out, leg = space.carried.memory, space.carried.sens, space.work.parts[0], _leg(drive, i)
    for k in range(core.codes.size):
        if core.memory[k]:
            code, o = core.codes[k], core.offsets[k]
            memory[k] = advance(code, core.p, o, memory[k], leg, True, out, space.work.leg)
            first = own(code, o)
            for j in range(sens.shape[1]):
                sens[k, j] *= out[BY_MEMORY]
            for j in range(own_count(code)):
                if core.column[first + j] >= 0:
                    sens[k, core.column[first + j]] += out[OWN + j]


@inlined
def _write_row(row, core, drive, i, f_u, space):
    """Gradient of the force at sample i."""
    dp, dm, sens, column = space.work.dp, space.work.dm, space.carried.sens, core.column
    for j in range(core.p.size):
        if column[j] >= 0:
            row[column[j]] = dp[j]
    for j in range(drive.du.shape[0]):
        row[j] += f_u * drive.du[j, i]
    for k in range(core.codes.size):
        if core.memory[k]:
            for j in range(sens.shape[1]):
                row[j] += dm[k] * sens[k, j]


@compiled
def rigid(core, drive, eps, force, jac, space, fresh):
    """Force of a `Core` along a `Drive` without a mount.

    force : (N,) float64, N; jac : (N, M) float64 or (0, M) when no gradient is wanted. Both are filled.
    eps : m/s, a velocity below is rest; space : a `Space`, zero where `fresh`;
    fresh : whether it begins with steady memories; else with those of the last run, at the first sample.
    """
    wanted = jac.shape[0] > 0
    memory = space.carried.memory
    if fresh:
        steady(core, drive.v, drive.x, memory, space.carried.sens)
    for i in range(drive.x.size):
        if i > 0 and core.remembers and wanted:
            _carry_sensitivities(core, drive, i, space)
        elif i > 0 and core.remembers:
            _carry_memories(core, drive, i, space)
        w = drive.v[i]
        at = Point(drive.x[i], w, sign(w, eps), drive.u[i], drive.temperature[i], drive.a[i], drive.v_m[i])
        answer = core_force(core, at, memory, space.work, wanted)
        force[i] = answer.f
        if wanted:
            _write_row(jac[i], core, drive, i, answer.by_u, space)
