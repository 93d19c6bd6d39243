"""The time loop of a layered network: see `layers` for its equations and the order of its weights."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import math

from identification.compiled import inlined, summing

_FAR = 40.0


@summing
def simulate(weights, nodes, codes, span, delays, inputs, begin, measured, limits, one, other, y):
    """Simulates from sample to sample, into `y` (N,), cut at the limits; `measured` before the begin of each run.

    `nodes`: of the hidden layers; `codes`: of the activations of these and of the output. All scaled; `one` and
    `other` are working space, as long as the widest layer or all regressors.
    """
    m, fed = inputs.shape[1], delays.size
    for t in range(y.size):
        if t < begin[t]:
            y[t] = measured[t]
            continue
        for i in range(fed):
            p = t - delays[i]
            one[i] = y[p] if p >= begin[t] else measured[p]
        for i in range(m):
            one[fed + i] = inputs[t, i]
        before, after, width, at = one, other, fed + m, 0
        for k in range(nodes.size):
            count = nodes[k]
            for j in range(count):
                s = weights[at + count * width + j]
                for i in range(width):
                    s += weights[at + j * width + i] * before[i]
                after[j] = _activated(codes[0], s)
            at += count * (width + 1)
            width = count
            before, after = after, before
        s = weights[at + width]
        for i in range(width):
            s += weights[at + i] * before[i]
        s = span[0] + span[1] * _activated(codes[1], s)
        s = s if s > limits[0] else limits[0]
        y[t] = s if s < limits[1] else limits[1]


@inlined
def _activated(code, z):
    if code == 0:
        return 1.0 / (1.0 + math.exp(-min(max(z, -_FAR), _FAR)))
    if code == 2:
        return math.tanh(z)
    if code == 3:
        return min(max(z, -1.0), 1.0)
    if code == 4:
        return math.exp(-min(z * z, _FAR))
    return z
