"""The next forces of a network, were one of its inputs held at each of some levels from a sample on; compiled."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.blackbox.loops import simulate
from identification.compiled import summing


@summing
def next_forces(weights, delays, inputs, force, at, columns, ages, levels, limits, nodes, rows, since, known, y, out):
    """The scaled force of the next J samples from sample `at` on, at every level of the held input, into `out` (K, J).

    inputs (N, m) and force (N,): the past that the network has, up to sample at − 1. The input stands in the `columns`
    of `inputs` with the delays `ages`; `levels` (K,) are scaled. rows (D + J, m), since, known and y (D + J,) are
    working space, D the longest delay.
    """
    size, ahead = y.size, out.shape[1]
    longest = size - ahead
    for i in range(size):
        since[i] = longest
        known[i] = force[at - longest + i] if i < longest else 0.0
        for k in range(inputs.shape[1]):
            rows[i, k] = inputs[at - longest + i, k]
    for k in range(levels.size):
        for c in range(columns.size):
            for i in range(longest + ages[c], size):
                rows[i, columns[c]] = levels[k]
        simulate(weights, delays, rows, since, known, limits, nodes, y)
        for j in range(ahead):
            out[k, j] = y[longest + j]
