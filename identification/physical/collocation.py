"""One step of a smooth mounted damper by three-stage Radau IIA (Hairer & Wanner 1996, IV.8): L-stable, of fifth order.

The stages are solved together for the rates r of the mount's extension e,

    f_core(x − e_i, v_i − r_i) = k e_i + c r_i + f2_i,   e_i = e + h Σ a_ij r_j,

by Newton's method from the extrapolated rates of the step before. The branch k2, c2 of a relaxing mount is linear, so
its force f2_i is eliminated beforehand. Where Newton's method fails (a force that jumps with position, say), the caller
takes the step by the method that brackets its solution.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.compiled import compiled, inlined, pasted
from identification.physical.core import core_force
from identification.physical.elements.equations.point import Point
from identification.physical.program import (
    BRANCH,
    CHANGE,
    EVERYTHING,
    EXPECTED,
    FIRST_RATE,
    RATE,
    TOLERANCE,
    E,
)
from identification.physical.stage import MET
from identification.physical.stages import ACCELERATION, AMPLITUDE, TEMPERATURE, U, core_values

Floats = NDArray[np.float64]

_ROOT6 = np.sqrt(6.0)
_NODES = np.array([(4.0 - _ROOT6) / 10.0, (4.0 + _ROOT6) / 10.0, 1.0])
_WEIGHTS = np.array(
    [
        [(88.0 - 7.0 * _ROOT6) / 360.0, (296.0 - 169.0 * _ROOT6) / 1800.0, (-2.0 + 3.0 * _ROOT6) / 225.0],
        [(296.0 + 169.0 * _ROOT6) / 1800.0, (88.0 + 7.0 * _ROOT6) / 360.0, (-2.0 - 3.0 * _ROOT6) / 225.0],
        [(16.0 - _ROOT6) / 36.0, (16.0 + _ROOT6) / 36.0, 1.0 / 9.0],
    ]
)
_AHEAD = np.vander(1.0 + _NODES, 3) @ np.linalg.inv(np.vander(_NODES, 3))  # the parabola through three rates, a step on
_RUNAWAY = 1e14  # times the tolerance of a velocity: a root ten times beyond the highest of the motion is another one
_ITERATIONS = 30
X, V = 0, 1  # columns of the stages


class Nodes(NamedTuple):
    """Arrays that one run of the collocation works in; `prepare` fills those that stay."""

    h_a: Floats  # (3, 3) h a_ij
    by_rate: Floats  # (3, 3) f2_i by r_j
    by_force: Floats  # (3,) f2_i by the branch's force at the beginning of the step
    shape: Floats  # (S, 3, 7) share of the sample interval at each stage, and the weights of the motion there
    driver: Floats  # (3, 4) what drives the core at each stage beside the motion
    rate: Floats  # (3,) r_i of the last step
    stage: Floats  # (3, 2) x and v at each stage
    slope: Floats  # (2, 3) slopes of the core's force by z and w at each stage
    rows: Floats  # (3, M) what each residual owes to the parameters; room for `explicit`
    m: Floats  # (3, 3) force of the mount by r_j


def nodes_of(columns: int, substeps: int) -> Nodes:
    """Arrays for a run with so many columns of the gradient and steps to a sample."""
    return Nodes(
        h_a=np.zeros((3, 3)), by_rate=np.zeros((3, 3)), by_force=np.zeros(3), shape=np.zeros((substeps, 3, 7)),
        driver=np.zeros((3, 4)), rate=np.zeros(3), stage=np.zeros((3, 2)), slope=np.zeros((2, 3)),
        rows=np.zeros((3, columns)), m=np.zeros((3, 3)),
    )  # fmt: skip


@compiled
def prepare(mount, dt, substeps, nodes):
    """Fills what does not change from step to step."""
    h_a, by_rate, by_force, shape = nodes.h_a, nodes.by_rate, nodes.by_force, nodes.shape
    h = dt / substeps
    for i in range(3):
        for j in range(3):
            h_a[i, j] = h * _WEIGHTS[i, j]
        for sub in range(substeps):
            q = (sub + _NODES[i]) / substeps  # cubic Hermite: exact at samples, fourth order between them
            shape[sub, i, 0] = q
            shape[sub, i, 1] = q * q * (3.0 - 2.0 * q)
            shape[sub, i, 2] = dt * q * (1.0 - q) * (1.0 - q)
            shape[sub, i, 3] = dt * q * q * (q - 1.0)
            shape[sub, i, 4] = 6.0 * q * (1.0 - q) / dt
            shape[sub, i, 5] = (3.0 * q - 1.0) * (q - 1.0)
            shape[sub, i, 6] = q * (3.0 * q - 2.0)
    if mount.k2 > 0.0:  # f2 = f2_start + k2 h A (r − f2/c2)
        s = mount.k2 / mount.c2
        inverse = _inverse(
            (1.0 + s * h_a[0, 0], s * h_a[0, 1], s * h_a[0, 2]),
            (s * h_a[1, 0], 1.0 + s * h_a[1, 1], s * h_a[1, 2]),
            (s * h_a[2, 0], s * h_a[2, 1], 1.0 + s * h_a[2, 2]),
        )
        for i in range(3):
            a, b, c = inverse[9] * inverse[3 * i], inverse[9] * inverse[3 * i + 1], inverse[9] * inverse[3 * i + 2]
            by_force[i] = a + b + c
            for j in range(3):
                by_rate[i, j] = mount.k2 * (a * h_a[0, j] + b * h_a[1, j] + c * h_a[2, j])
    for i in range(3):
        for j in range(3):
            nodes.m[i, j] = mount.k * h_a[i, j] + by_rate[i, j]


@inlined
def _inverse(first, second, third):
    """Inverse of a matrix given by its rows, times its determinant, and 1 over that."""
    a, b, c = first
    d, e, f = second
    g, h, k = third
    p, q, r = e * k - f * h, f * g - d * k, d * h - e * g
    return (
        p, c * h - b * k, b * f - c * e,
        q, a * k - c * g, c * d - a * f,
        r, b * g - a * h, a * e - b * d,
        1.0 / (a * p + b * q + c * r),
    )  # fmt: skip


@inlined
def _times(inverse, g0, g1, g2):
    """The inverse of a matrix times a vector."""
    i = inverse
    return (
        i[9] * (i[0] * g0 + i[1] * g1 + i[2] * g2),
        i[9] * (i[3] * g0 + i[4] * g1 + i[5] * g2),
        i[9] * (i[6] * g0 + i[7] * g1 + i[8] * g2),
    )


@inlined
def _place(core, drive, i, shape, nodes):
    """The velocity at the three stages; where the core is driven by more, that too."""
    x, v, u, stage, driver = drive.x, drive.v, drive.u, nodes.stage, nodes.driver
    dx = x[i + 1] - x[i]
    for s in range(3):
        q = shape[s, 0]
        stage[s, V] = shape[s, 4] * dx + shape[s, 5] * v[i] + shape[s, 6] * v[i + 1]
        if core.driven > 0:
            stage[s, X] = x[i] + shape[s, 1] * dx + shape[s, 2] * v[i] + shape[s, 3] * v[i + 1]
            driver[s, U] = u[i] + q * (u[i + 1] - u[i])
        if core.driven == EVERYTHING:
            driver[s, TEMPERATURE] = drive.temperature[i] + q * (drive.temperature[i + 1] - drive.temperature[i])
            driver[s, ACCELERATION] = drive.a[i] + q * (drive.a[i + 1] - drive.a[i])
            driver[s, AMPLITUDE] = drive.v_m[i] + q * (drive.v_m[i + 1] - drive.v_m[i])


@inlined
def _along(s, table, r):
    """Σ over the stages of a row of `table` times the rates."""
    return table[s, 0] * r[0] + table[s, 1] * r[1] + table[s, 2] * r[2]


@inlined
def _slopes(cm, f_z, f_w, h_a, m):
    """Inverse of the slopes of the residuals by the rates, signs changed."""
    return _inverse(
        (f_w[0] + cm[0] + m[0, 0] + f_z[0] * h_a[0, 0], m[0, 1] + f_z[0] * h_a[0, 1], m[0, 2] + f_z[0] * h_a[0, 2]),
        (m[1, 0] + f_z[1] * h_a[1, 0], f_w[1] + cm[1] + m[1, 1] + f_z[1] * h_a[1, 1], m[1, 2] + f_z[1] * h_a[1, 2]),
        (m[2, 0] + f_z[2] * h_a[2, 0], m[2, 1] + f_z[2] * h_a[2, 1], f_w[2] + cm[2] + m[2, 2] + f_z[2] * h_a[2, 2]),
    )


@pasted
def collocate(core, drive, mounting, at, space, nodes, wanted):
    """A step as `mounted._step` takes it; returns whether it converged, and leaves all as it was where it did not."""
    i, sub, _ = at
    mount, state, work = mounting[0], space.carried.state, space.work
    h_a, by_rate, by_force, driver, rate, stage, m = (
        nodes.h_a, nodes.by_rate, nodes.by_force, nodes.driver, nodes.rate, nodes.stage, nodes.m,
    )  # fmt: skip
    shape, changed = nodes.shape[sub], core.modified or core.rare or core.leans
    _place(core, drive, i, shape, nodes)
    k, c, by_u, e0, f2, tolerance = mount.k, mount.c, mount.c_control, state[E], state[BRANCH], state[TOLERANCE]
    cm = (c + by_u * driver[0, U], c + by_u * driver[1, U], c + by_u * driver[2, U])
    base0, base1, base2 = k * e0 + by_force[0] * f2, k * e0 + by_force[1] * f2, k * e0 + by_force[2] * f2
    r = (rate[0], rate[1], rate[2])
    r = (_along(0, _AHEAD, r), _along(1, _AHEAD, r), _along(2, _AHEAD, r))
    d0, d1, d2, last, iterations, ready = 0.0, 0.0, 0.0, np.inf, 0, False
    z = (0.0, 0.0, 0.0)
    while not ready and iterations < _ITERATIONS:
        iterations += 1
        if core.driven > 0:  # else the force does not depend on the position
            a0, a1, a2 = _along(0, h_a, r), _along(1, h_a, r), _along(2, h_a, r)
            z = (stage[0, X] - e0 - a0, stage[1, X] - e0 - a1, stage[2, X] - e0 - a2)
        w = (stage[0, V] - r[0], stage[1, V] - r[1], stage[2, V] - r[2])
        f, f_z, f_w = core_values(core, z, w, driver, work.trial, work, changed)
        g0 = f[0] - base0 - cm[0] * r[0] - _along(0, m, r)
        g1 = f[1] - base1 - cm[1] * r[1] - _along(1, m, r)
        g2 = f[2] - base2 - cm[2] * r[2] - _along(2, m, r)
        size = abs(g0) + abs(g1) + abs(g2)
        if size > last:  # Newton's step led uphill
            d0, d1, d2 = 0.5 * d0, 0.5 * d1, 0.5 * d2
            r = (r[0] - d0, r[1] - d1, r[2] - d2)
        else:
            last = size
            d0, d1, d2 = _times(_slopes(cm, f_z, f_w, h_a, m), g0, g1, g2)
            r = (r[0] + d0, r[1] + d1, r[2] + d2)
            # Newton squares its error: what is within MET now is at round-off after this step.
            ready = (
                abs(d0) < MET * abs(w[0] - d0) + tolerance
                and abs(d1) < MET * abs(w[1] - d1) + tolerance
                and abs(d2) < MET * abs(w[2] - d2) + tolerance
                and abs(r[0]) + abs(r[1]) + abs(r[2]) < _RUNAWAY * tolerance
            )
    if ready:
        rate[0], rate[1], rate[2] = r
        if wanted:
            _sensitivities(core, drive, mounting, i, space, nodes, shape)
        state[E], state[RATE] = e0 + _along(2, h_a, r), r[2]
        state[BRANCH] = by_force[2] * f2 + _along(2, by_rate, r)
        state[EXPECTED], state[FIRST_RATE], state[CHANGE] = r[2], r[2], 0.0
    return ready


@inlined
def _sensitivities(core, drive, mounting, i, space, nodes, shape):
    """Carries all sensitivities over the step whose rates have been found."""
    h_a, driver, rate, stage, slope = nodes.h_a, nodes.driver, nodes.rate, nodes.stage, nodes.slope
    mount, e0 = mounting[0], space.carried.state[E]
    c, by_u = mount.c, mount.c_control
    for s in range(3):
        w, e = stage[s, V] - rate[s], e0 + _along(s, h_a, rate)
        at = Point(
            stage[s, X] - e, w, 1.0 if w > 0 else -1.0, driver[s, U], driver[s, TEMPERATURE],
            driver[s, ACCELERATION], driver[s, AMPLITUDE],
        )  # fmt: skip
        answer = core_force(core, at, space.work.trial, space.work, True)
        slope[0, s], slope[1, s] = answer.by_z, answer.by_w
        met = (s, shape[s, 0], e, rate[s], driver[s, U])
        _explicit(core, drive, mounting[1], i, met, answer.by_u - by_u * rate[s], space.work.dp, nodes.rows)
    cm = (c + by_u * driver[0, U], c + by_u * driver[1, U], c + by_u * driver[2, U])
    f_z, f_w = (slope[0, 0], slope[0, 1], slope[0, 2]), (slope[1, 0], slope[1, 1], slope[1, 2])
    inverse = _slopes(cm, f_z, f_w, h_a, nodes.m)
    _carry(inverse, mounting, f_z, nodes, space)


@inlined
def _explicit(core, drive, mount_column, i, met, by_current, dp, rows):
    """What the residual of a stage owes to the parameters directly: core, control and the mount's spring and damper.

    `met` is the stage's number, share of the sample interval, extension, rate and current.
    """
    s, q, e, r, u = met
    for j in range(rows.shape[1]):
        rows[s, j] = 0.0
    for j in range(core.p.size):
        if core.column[j] >= 0:
            rows[s, core.column[j]] += dp[j]
    for j in range(drive.du.shape[0]):
        rows[s, j] += by_current * (drive.du[j, i] + q * (drive.du[j, i + 1] - drive.du[j, i]))
    if mount_column.k >= 0:
        rows[s, mount_column.k] -= e
    if mount_column.c >= 0:
        rows[s, mount_column.c] -= r
    if mount_column.c_control >= 0:
        rows[s, mount_column.c_control] -= u * r


@inlined
def _carry(inverse, mounting, f_z, nodes, space):
    """Carries the sensitivities of e and of the branch's force over the step, by the implicit function theorem on the
    residuals, of which `nodes.rows` holds the explicit part; `stages.rate` gets that of the last rate.
    """
    h_a, by_rate, by_force, rate, rows = nodes.h_a, nodes.by_rate, nodes.by_force, nodes.rate, nodes.rows
    mount, column = mounting
    de, last, f2 = space.carried.de, space.stages.rate, space.carried.state[BRANCH]
    of_branch = space.carried.sens[space.carried.memory.size]
    relaxes = mount.k2 > 0.0
    end_k2, end_c2 = 0.0, 0.0
    for s in range(3 if relaxes else 0):
        end_k2, end_c2 = 0.0, 0.0
        for t in range(3):
            f = by_force[t] * f2 + _along(t, by_rate, rate)
            end_k2 += by_rate[s, t] / mount.k2 * (rate[t] - f / mount.c2)
            end_c2 += by_rate[s, t] / (mount.c2 * mount.c2) * f
        if column.k2 >= 0:
            rows[s, column.k2] -= end_k2
        if column.c2 >= 0:
            rows[s, column.c2] -= end_c2
    s0, s1, s2 = f_z[0] + mount.k, f_z[1] + mount.k, f_z[2] + mount.k
    for j in range(de.size):
        g0 = rows[0, j] - s0 * de[j] - by_force[0] * of_branch[j]
        g1 = rows[1, j] - s1 * de[j] - by_force[1] * of_branch[j]
        g2 = rows[2, j] - s2 * de[j] - by_force[2] * of_branch[j]
        d = _times(inverse, g0, g1, g2)
        de[j] += _along(2, h_a, d)
        last[j] = d[2]
        of_branch[j] = by_force[2] * of_branch[j] + _along(2, by_rate, d)
    if relaxes and column.k2 >= 0:
        of_branch[column.k2] += end_k2
    if relaxes and column.c2 >= 0:
        of_branch[column.c2] += end_c2
