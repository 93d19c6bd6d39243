"""The time loop of a damper that is bolted to the rig: z = x and w = v, every sample is one evaluation."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from typing import Any

import numpy as np

from identification.physical.compiled import compiled
from identification.physical.core import core_force, has_rare
from identification.physical.friction import sign
from identification.physical.memory import PARTIALS, advance, is_memory, own, own_count, steady
from identification.physical.modifiers import has_modifier


def workspace(elements: int, parameters: int, columns: int) -> tuple[Any, ...]:  # Any: a nest of arrays, opaque outside
    """Arrays that one run of `rigid` or `mounted` works in, all zero; `mounted` wants a `collocation_space` too."""
    rows = elements + 2  # the last two belong to the relaxing branch of a mount and to the core's last velocity
    return (
        np.zeros(elements),  # memories
        np.zeros((rows, columns)),  # their sensitivities
        np.zeros(columns),  # sensitivity of the extension
        np.zeros(10),  # state of the mount's extension, see `mounted._step`
        (np.zeros(elements), np.zeros((rows, columns)), np.zeros(columns), np.zeros(10)),  # kept for a retry
        (
            np.zeros(elements),
            np.zeros((elements, PARTIALS)),
            np.zeros(PARTIALS),
            np.zeros(parameters + 1),
            np.zeros(elements),
        ),
        (np.zeros(columns), np.zeros(columns), np.zeros(columns)),
    )


@compiled
def rigid(codes, offsets, p, column, dt, inputs, du, eps, force, jac, space):
    """Core force along a motion without a mount.

    inputs : x, v, u, temperature, a and v_m, each (N,) float64
    column : (P,) int64, the column of `jac` of each core parameter, −1 where none is wanted
    du : (C, N) float64, sensitivities of u by the first C columns of `jac`
    force : (N,) float64, N; jac : (N, M) float64 or (0, M) when no gradient is wanted. Both are filled.
    space : a fresh `workspace`
    """
    n_el = codes.size
    x, v, u, temperature, a, v_m = inputs
    memory, sens, out = space[0], space[1], space[5][1][0]
    _, _, tmp, dp, dm = space[5]
    wanted = jac.shape[0] > 0
    modified, rare = has_modifier(codes), has_rare(codes)
    steady(codes, offsets, p, column, v[0], x, memory, sens)
    for i in range(x.size):
        z, w = x[i], v[i]
        s = sign(w, eps)
        if i > 0:
            for k in range(n_el):
                code = codes[k]
                if is_memory(code):
                    memory[k] = advance(code, p, offsets[k], memory[k], x[i - 1], z, v[i - 1], w, dt, wanted, out, tmp)
                    if wanted:
                        first = own(code, offsets[k])
                        for j in range(sens.shape[1]):
                            sens[k, j] *= out[0]
                        for j in range(own_count(code)):
                            if column[first + j] >= 0:
                                sens[k, column[first + j]] += out[2 + j]
        f, _, _, f_u, _ = core_force(
            codes, offsets, p, z, w, s, u[i], temperature[i], a[i], v_m[i], memory, dp, dm, modified, rare, wanted
        )  # fmt: skip
        force[i] = f
        if wanted:
            for j in range(p.size):
                if column[j] >= 0:
                    jac[i, column[j]] = dp[j]
            for j in range(du.shape[0]):
                jac[i, j] += f_u * du[j, i]
            for k in range(n_el):
                if is_memory(codes[k]):
                    for j in range(sens.shape[1]):
                        jac[i, j] += dm[k] * sens[k, j]
