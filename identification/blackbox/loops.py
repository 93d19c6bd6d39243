"""The time loops of a recurrent network: its simulation, and the gradient of that by forward sensitivities.

y(t) = c·φ(t) + c₀ + Σ_j W_j·tanh(V_j·φ(t) + V_j0), clipped to [low, high], with
φ(t) = [y(t − d) for every delay d, then the m inputs of sample t].

`weights` holds V first, a row of H for each of the R regressors and one for the bias; then W (H,); then c (R,) and c₀.
`nodes` is a tuple of H entries, H a multiple of four: its length is known when the loop is compiled (see `lanes`).
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# mypy: disable-error-code="call-arg, var-annotated, unreachable"

from __future__ import annotations

from identification.blackbox.lanes import added, inner, product, put, scaled, taken
from identification.blackbox.tangent import tanh
from identification.compiled import summing


@summing
def simulate(weights, delays, inputs, since, measured, limits, nodes, y):
    """Simulates from sample to sample, into `y` (N,).

    Sample t is simulated where t ≥ since[t], and given by `measured` otherwise; what it feeds back is simulated from
    sample since[t] on, and measured before. All scaled.
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
        s, z = weights[line + r], taken(weights, r * h, nodes)
        for i in range(r - 1, -1, -1):  # the last force comes last: all else can be computed while it is awaited
            u = _regressor(i, t, fed, delays, inputs, since, measured, y)
            s += weights[line + i] * u
            z = added(z, taken(weights, i * h, nodes), u)
        s += inner(taken(weights, out, nodes), tanh(z))
        s = s if s > limits[0] else limits[0]
        y[t] = s if s < limits[1] else limits[1]


@summing
def gradient(weights, delays, inputs, since, measured, limits, nodes, span, gains, y, rows):
    """The derivative of y(t) by every weight, for the samples of a `span`, into the last rows of `rows`.

    `rows` (most + span, P): its first rows hold those of the samples before the span, as many as the longest delay.
    y : (N,) what `simulate` gave; `gains`, one for each delay, is working space. The delays rise.
    """
    h, fed = len(nodes), delays.size
    r = fed + inputs.shape[1]
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
        z = taken(weights, r * h, nodes)
        for i in range(r):
            u = _regressor(i, t, fed, delays, inputs, since, measured, y)
            row[line + i] = u
            z = added(z, taken(weights, i * h, nodes), u)
        row[line + r] = 1.0
        q, w = tanh(z), taken(weights, out, nodes)
        g = added(w, product(product(q, q), w), -1.0)  # W_j·(1 − tanh²)
        back = 0  # delays at which the force was simulated
        while back < fed and t - delays[back] >= since[t]:
            gains[back] = weights[line + back] + inner(g, taken(weights, back * h, nodes))  # ∂y(t)/∂y(t − d)
            back += 1
        for i in range(r + 2):  # each number of a row is written once: that costs as much as its sums
            lanes = scaled(g, row[line + i]) if i <= r else q
            for k in range(back):
                lanes = added(lanes, taken(rows[t - delays[k] + ahead], i * h, nodes), gains[k])
            put(row, i * h, lanes)
        for k in range(back):
            before = rows[t - delays[k] + ahead]
            for i in range(line, row.size):
                row[i] += gains[k] * before[i]


@summing
def _regressor(i, t, fed, delays, inputs, since, measured, y):
    if i >= fed:
        return inputs[t, i - fed]
    p = t - delays[i]
    return y[p] if p >= since[t] else measured[p]


@summing
def polynomial(coefficients, table, delays, inputs, since, measured, limits, phi, y):
    """Simulates y(t) = Σ_k c_k·Π_d φ[table[k, d]] from sample to sample, into `y` (N,); see `simulate`.

    `limits`: the lowest and the highest force, those between which a past force is seen, and the lowest and the highest
    change of a seen force from a sample to the next. `phi` (R + 1,) is working space whose last entry is 1.
    """
    fed, m = delays.size, inputs.shape[1]
    for t in range(y.size):
        if t < since[t]:
            y[t] = measured[t]
            continue
        for i in range(fed):
            p = t - delays[i]
            s = y[p] if p >= since[t] else measured[p]
            s = s if s > limits[2] else limits[2]
            s = s if s < limits[3] else limits[3]
            if i > 0:
                apart = delays[i] - delays[i - 1]
                low, high = phi[i - 1] - apart * limits[5], phi[i - 1] - apart * limits[4]
                s = s if s > low else low
                s = s if s < high else high
            phi[i] = s
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
