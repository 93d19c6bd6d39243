"""One step of a Bouc–Wen hysteresis behind a dashpot by the classical Runge–Kutta method, of fourth order.

Where the core is linear in its velocity, that follows at once from the extension of the mount e and the memory h,

    f_core(x − e, v − r, h) = k e + c r,   de/dt = r,   dh/dt = A w − gamma |w| h |h|^(n−1) − beta w |h|^n,   w = v − r,

and no equation has to be solved (Spencer, Dyke, Sain & Carlson 1997 is such a model). Where that is stiff the caller
takes the step by an implicit method. The sensitivities are those of these very stages.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np

from identification.physical.compiled import compiled, inlined, pasted
from identification.physical.core import core_force
from identification.physical.elements import Code
from identification.physical.memory import fading, is_memory
from identification.physical.mount import C_CONTROL, GAP, K2, C, K, add_mount_partials
from identification.physical.stage import between

_VISCOUS, _BOUC_WEN, _STIFFNESS = int(Code.VISCOUS), int(Code.BOUC_WEN), int(Code.STIFFNESS)
_FADE = int(Code.FADE)
_AHEAD, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
_PART = 0.5  # of the travel in which the memory fades by e: the longest step
_MOST = 8  # such steps in one; of more the memory keeps nothing, and the implicit step knows that
_STIFF = 1.0  # rate of the extension times the step, beyond which the implicit step is the better one


@compiled
def explicit_memory(codes, offsets, p, mount):
    """Index of the one memory of a core that is linear in velocity, behind a damper; −1 of any other; and its rate of
    fading, 1/m.
    """
    found, rate = -1, 0.0
    fits = mount[C] > 0.0 and mount[K2] == 0.0 and mount[GAP] == 0.0
    for k in range(codes.size):
        fits = fits and (codes[k] in (_VISCOUS, _BOUC_WEN) or _STIFFNESS <= codes[k] <= _FADE)
        if is_memory(codes[k]):
            fits = fits and found < 0
            found, rate = k, 1.0 / fading(p, offsets[k], p[offsets[k] + 2])
    return (found if fits else -1), rate


@inlined
def _wen(p, o, w, h):
    """dh/dt, its slopes by w and h, and h |h|^(n−1)."""
    n = p[o + 2]
    m = abs(h) ** (n - 1.0)
    s, sgn = (1.0 if w > 0.0 else -1.0), (1.0 if h > 0.0 else -1.0)
    by_w = p[o + 1] - s * h * m * (p[o + 4] + s * sgn * p[o + 3])
    return by_w * w, by_w, -n * m * (p[o + 4] * abs(w) + p[o + 3] * w * sgn), h * m


@pasted
def explicit(
    program, mount, mount_column, motion, i, sub, substeps, only, rate, state, memory, du, sens, de, work, grads, rows,
    wanted,
):  # fmt: skip
    """A step as `mounted._step` takes it; returns whether it was taken, and leaves all as it was where it was not.

    `only` and `rate` are those of `explicit_memory`; `rows` (3, M) is room for sensitivities.
    """
    codes, offsets, p = program[0], program[1], program[2]
    v, dt = motion[1], motion[6]
    trial, _, _, dp, dm = work
    dr, sum_r, sum_g, dg = grads[1], rows[0], rows[1], rows[2]
    o, h = offsets[only], dt / substeps
    parts = 1 + int(min(h * rate / _PART * max(abs(state[2]), abs(v[i + 1])), _MOST))
    taken, step = parts <= _MOST, h / parts
    e, w, m, r, x, f_z, f_u, inverse = state[0], state[2], memory[only], 0.0, 0.0, 0.0, 0.0, 0.0
    for part in range(parts + 1 if taken else 0):
        g, total_r, total_g = 0.0, 0.0, 0.0
        for stage in range(4 if part < parts else 1):  # the first of the step that would follow is the end of this one
            q = (sub + (part + _AHEAD[stage]) / parts) / substeps
            x, vs, inputs = between(motion, i, q)
            u, ahead, weight = inputs[0], _AHEAD[stage] * step, _WEIGHTS[stage] * step
            es, c, trial[only] = e + ahead * r, mount[C] + mount[C_CONTROL] * u, m + ahead * g
            for _ in range(2 if wanted else 1):  # the partials are wanted at the velocity that the first pass finds
                f, f_z, f_w, f_u, _ = core_force(
                    codes, offsets, p, x - es, w, 0.0, *inputs, trial, dp, dm, program[4], False, wanted
                )
                inverse = 1.0 / (f_w + c)
                w += (mount[K] * es + c * (vs - w) - f) * inverse  # at once, as f is linear in w
            r = vs - w
            g, by_w, by_h, pull = _wen(p, o, w, trial[only])
            if part == 0 and stage == 0:
                stiff = mount[K] + abs(f_z) + abs(dm[only] * by_w)
                taken = inverse > 0.0 and stiff * inverse * step <= _STIFF
                if not taken:
                    break
            total_r, total_g = total_r + weight * r, total_g + weight * g
            if wanted:
                for j in range(de.size):
                    by_m = sens[only, j] + ahead * dg[j]
                    dr[j] = dm[only] * by_m - (f_z + mount[K]) * (de[j] + ahead * dr[j])
                    dg[j] = by_h * by_m
                _direct(dr, dg, program[3], p, dp, o, w, trial[only], pull)
                for j in range(du.shape[0]):
                    dr[j] += (f_u - mount[C_CONTROL] * r) * (du[j, i] + q * (du[j, i + 1] - du[j, i]))
                add_mount_partials(dr, mount_column, es, r, u, mount, -1.0)
                for j in range(de.size):
                    dr[j] *= inverse
                    dg[j] -= by_w * dr[j]
                    sum_r[j] = (sum_r[j] if stage > 0 else 0.0) + weight * dr[j]
                    sum_g[j] = (sum_g[j] if stage > 0 else 0.0) + weight * dg[j]
        if taken and part < parts:
            e, m = e + total_r, m + total_g
            for j in range(de.size if wanted else 0):
                de[j] += sum_r[j]
                sens[only, j] += sum_g[j]
        elif not taken:
            break
    if taken:
        memory[only] = m
        state[0], state[1], state[2], state[5] = e, x - e, w, r
        state[3], state[7], state[8] = r, r, 0.0
        for j in range(de.size if wanted else 0):
            sens[codes.size + 1, j] = -dr[j]
    return taken


@inlined
def _direct(dr, dg, column, p, dp, o, w, h, pull):
    """What the force and the rate of the memory owe to the parameters of the core directly."""
    for j in range(p.size):
        if column[j] >= 0:
            dr[column[j]] += dp[j]
    if column[o + 1] >= 0:
        dg[column[o + 1]] += w
    if column[o + 2] >= 0:
        dg[column[o + 2]] -= (p[o + 4] * abs(w) * pull + p[o + 3] * w * abs(pull)) * np.log(max(abs(h), 1e-300))
    if column[o + 3] >= 0:
        dg[column[o + 3]] -= w * abs(pull)
    if column[o + 4] >= 0:
        dg[column[o + 4]] -= abs(w) * pull
