"""Loops over whole series of a response: a filter, a slope, and the sum of the gradients of parts."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.compiled import compiled


@compiled
def ramped(b, a, lag, series, state):
    """Fills the `state`, (2, columns), that such a filter has before `series`, (N, K) of two samples at least, after a
    long ramp of its first slope; what follows is `lag` samples behind the ramp."""
    for j in range(state.shape[1]):
        ramp = series[1, j] - series[0, j]
        last, older = series[0, j] - ramp, series[0, j] - 2.0 * ramp
        late, later = last - lag * ramp, older - lag * ramp
        state[0, j] = b[1] * last + b[2] * older - a[1] * late - a[2] * later
        state[1, j] = b[2] * last - a[2] * late


@compiled
def follow(b, a, mean, state, series, columns):
    """Puts what a filter of up to two poles makes of the first `columns` of `series`, (N, K), in their place.

    b, a : (3,) its coefficients, the latest sample first, a[0] = 1.
    mean : (columns,) what passes as it is.
    state : (2, columns) of its transposed direct form II before the first sample; after it, that after the last one.
    """
    for i in range(series.shape[0]):
        for j in range(columns):
            now = series[i, j] - mean[j]
            late = b[0] * now + state[0, j]
            state[0, j] = b[1] * now - a[1] * late + state[1, j]
            state[1, j] = b[2] * now - a[2] * late
            series[i, j] = late + mean[j]


@compiled
def leave(b, a, mean, state, series, samples, columns):
    """Takes the `state` of such a filter over the first `samples` of a series that stays as it is."""
    for i in range(samples):
        for j in range(columns):
            now = series[i, j] - mean[j]
            late = b[0] * now + state[0, j]
            state[0, j] = b[1] * now - a[1] * late + state[1, j]
            state[1, j] = b[2] * now - a[2] * late


@compiled
def means(series, samples, columns, out):
    """Fills `out`, (columns,), with the means of the first `samples` of the first `columns` of `series`, (N, K)."""
    for j in range(columns):
        out[j] = 0.0
    for i in range(samples):
        for j in range(columns):
            out[j] += series[i, j]
    for j in range(columns):
        out[j] /= samples


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
