"""Loops over whole series of a motion and of a force."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import math

from identification.compiled import compiled


@compiled
def between(x, v, a, late, dt, out):
    """Fills `out`, (3, N), with `x`, `v` and `a`, (N,) each, `late` samples ago, by cubic Hermite polynomials.

    Of x and v the slope is the next one; of a it follows from the samples on both sides. Every sample lies at the same
    place q between two others, so that their weights are the same for all. Beyond the samples the nearest is held.
    """
    n = x.size
    whole = int(min(max(math.floor(late), -n - 1.0), n))
    q = 1.0 - min(max(late - whole, 0.0), 1.0)
    left, right = (2.0 * q - 3.0) * q * q + 1.0, (3.0 - 2.0 * q) * q * q
    leaving, coming = dt * q * (1.0 - q) * (1.0 - q), dt * q * q * (q - 1.0)
    last = n - 1
    for i in range(n):
        k = i - whole  # the sample on the right of it
        if k < 1 or k > last:
            near = 0 if k < 1 else last
            out[0, i], out[1, i], out[2, i] = x[near], v[near], a[near]
            continue
        before = (a[1] - a[0]) / dt if k == 1 else (a[k] - a[k - 2]) / (2.0 * dt)
        after = (a[last] - a[last - 1]) / dt if k == last else (a[k + 1] - a[k - 1]) / (2.0 * dt)
        out[0, i] = left * x[k - 1] + right * x[k] + leaving * v[k - 1] + coming * v[k]
        out[1, i] = left * v[k - 1] + right * v[k] + leaving * a[k - 1] + coming * a[k]
        out[2, i] = left * a[k - 1] + right * a[k] + leaving * before + coming * after


@compiled
def is_constant(series):
    """Whether every value of a series, (N,), is its first one."""
    others = 0
    for value in series:
        others += 1 if value != series[0] else 0
    return others == 0


@compiled
def is_beyond(series, limit):
    """Whether a value of a series, (N,) or (N, K), is larger than a limit in size, or is none."""
    beyond = 0
    for value in series.flat:
        beyond += 0 if abs(value) <= limit else 1
    return beyond > 0
