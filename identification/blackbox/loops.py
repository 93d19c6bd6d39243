"""The time loops of a recurrent network: its simulation, and the gradient of that by forward sensitivities.

y(t) = c·φ(t) + c₀ + Σ_j W_j·tanh(V_j·φ(t) + V_j0), clipped to [low, high], with
φ(t) = [y(t − d) for every delay d, then the m inputs of sample t].

`weights` holds V first, a row of H for each of the R regressors and one for the bias; then W (H,); then c (R,) and c₀.
`nodes` is a tuple of H entries, H a multiple of four: its length is known when the loop is compiled.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from identification.blackbox.tangent import tanh
from identification.compiled import summing


@summing
def simulate(weights, delays, inputs, since, measured, limits, nodes, z, y):
    """Simulates from sample to sample, into `y` (N,).

    Sample t is simulated where t ≥ since[t], and given by `measured` otherwise; what it feeds back is simulated from
    sample since[t] on, and measured before. All scaled; `z` (H,) is working space.
    """
    n, m = inputs.shape
    h, fed = len(nodes), delays.size
    r = fed + m
    out = (r + 1) * h
    line = out + h
    for t in range(n):
        if t < since[t]:
            y[t] = measured[t]
            continue
        s = weights[line + r]
        for j in range(h):
            z[j] = weights[r * h + j]
        for i in range(m):
            u = inputs[t, i]
            s += weights[line + fed + i] * u
            for j in range(h):
                z[j] += weights[(fed + i) * h + j] * u
        for i in range(fed - 1, 0, -1):
            p = t - delays[i]
            u = y[p] if p >= since[t] else measured[p]
            s += weights[line + i] * u
            for j in range(h):
                z[j] += weights[i * h + j] * u
        u = 0.0  # the last force comes last: all else can be computed while it is awaited
        if fed:
            p = t - delays[0]
            u = y[p] if p >= since[t] else measured[p]
            s += weights[line] * u
        for j in range(h):
            s += weights[out + j] * tanh(z[j] + weights[j] * u)
        s = s if s > limits[0] else limits[0]
        y[t] = s if s < limits[1] else limits[1]


@summing
def gradient(weights, delays, inputs, since, measured, limits, nodes, span, z, g, y, rows):
    """The derivative of y(t) by every weight, for the samples of a `span`, into the last rows of `rows`.

    `rows` (most + span, P): its first rows hold those of the samples before the span, as many as the longest delay.
    y : (N,) what `simulate` gave; `z`, `g` (H,) are working space.
    """
    m = inputs.shape[1]
    h, fed = len(nodes), delays.size
    r = fed + m
    out = (r + 1) * h
    line = out + h
    first, last = span
    ahead = rows.shape[0] - (last - first) - first  # of the row over the sample
    for t in range(first, last):
        row = rows[t + ahead]
        if t < since[t] or y[t] == limits[0] or y[t] == limits[1]:
            for k in range(row.size):
                row[k] = 0.0
            continue
        for j in range(h):
            z[j] = weights[r * h + j]
        for i in range(r):
            u = _regressor(i, t, fed, delays, inputs, since, measured, y)
            row[line + i] = u
            for j in range(h):
                z[j] += weights[i * h + j] * u
        row[line + r] = 1.0
        for j in range(h):
            q = tanh(z[j])
            row[out + j] = q
            g[j] = weights[out + j] * (1.0 - q * q)
            row[r * h + j] = g[j]
        for i in range(r):
            u = row[line + i]
            for j in range(h):
                row[i * h + j] = g[j] * u
        for i in range(0, fed, 2):  # two at once: each pass over a row costs as much as its sums
            if t - delays[i] < since[t]:
                break
            one, before = _gain(i, g, weights, line, nodes), rows[t - delays[i] + ahead]
            other, earlier = 0.0, before
            if i + 1 < fed and t - delays[i + 1] >= since[t]:
                other, earlier = _gain(i + 1, g, weights, line, nodes), rows[t - delays[i + 1] + ahead]
            for k in range(row.size):
                row[k] += one * before[k] + other * earlier[k]


@summing
def _gain(i, g, weights, line, nodes):
    """∂y(t)/∂y(t − d) of the force of the i-th delay."""
    gain = weights[line + i]
    for j in range(len(nodes)):
        gain += g[j] * weights[i * len(nodes) + j]
    return gain


@summing
def _regressor(i, t, fed, delays, inputs, since, measured, y):
    if i >= fed:
        return inputs[t, i - fed]
    p = t - delays[i]
    return y[p] if p >= since[t] else measured[p]


@summing
def polynomial(coefficients, table, delays, inputs, since, measured, limits, phi, y):
    """Simulates y(t) = Σ_k c_k·Π_d φ[table[k, d]] from sample to sample, into `y` (N,); see `simulate`.

    `phi` (R + 1,) is working space whose last entry is 1.
    """
    fed, m = delays.size, inputs.shape[1]
    for t in range(y.size):
        if t < since[t]:
            y[t] = measured[t]
            continue
        for i in range(fed):
            p = t - delays[i]
            phi[i] = y[p] if p >= since[t] else measured[p]
        for i in range(m):
            phi[fed + i] = inputs[t, i]
        s = 0.0
        for k in range(coefficients.size):
            product = coefficients[k]
            for d in range(table.shape[1]):
                product *= phi[table[k, d]]
            s += product
        s = s if s > limits[0] else limits[0]
        y[t] = s if s < limits[1] else limits[1]
