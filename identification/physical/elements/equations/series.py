"""Loops over whole series of a response: a filter, a slope, and the sum of the gradients of parts."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled


@compiled
def follow(b, a, state, series, out):
    """Fills `out`, (N, K), with what a filter of up to two poles makes of `series`, (N, K).

    b, a : (3,) its coefficients, the latest sample first, a[0] = 1.
    state : (2, K) of its transposed direct form II before the first sample; after it, that after the last one.
    """
    for j in range(series.shape[1]):
        first, second = state[0, j], state[1, j]
        for i in range(series.shape[0]):
            now = series[i, j]
            late = b[0] * now + first
            first = b[1] * now - a[1] * late + second
            second = b[2] * now - a[2] * late
            out[i, j] = late
        state[0, j], state[1, j] = first, second


@compiled
def slope(series, dt, out):
    """Fills `out`, (N,), with the slope of `series`, (N,) of two samples at least: by the samples on both sides, at the
    ends by the last two."""
    last = series.size - 1
    for i in range(1, last):
        out[i] = (series[i + 1] - series[i - 1]) / (2.0 * dt)
    out[0] = (series[1] - series[0]) / dt
    out[last] = (series[last] - series[last - 1]) / dt


@compiled
def add_columns(total, columns, own):
    """Adds each column of `own`, (N, K), to that of `total`, (N, P), whose number `columns`, (K,) int64, tells."""
    for i in range(own.shape[0]):
        for j in range(columns.size):
            total[i, columns[j]] += own[i, j]
