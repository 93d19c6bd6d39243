"""A coil whose field rises and falls with times of their own: exact for a current that is linear between samples."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

import numpy as np
from numba import njit

_END, _ZERO, _MET = range(3)  # what ends a piece of an interval: its end, a current of zero, a current equal to u


@njit(cache=True)
def coil_loop(first, i, step, du, own, taus, dt):
    """u (N,) of du/dt = (i − u)/tau from its `first` value on, tau = `taus[0]` where (i − u)·i > 0, else `taus[1]`.

    i (N,) is linear between samples, or held where it steps.
    `du` (C, N), ∂i by what stands before in the path, becomes ∂u; `own` (2, N) gets ∂u by both times.
    """
    u, given, at = np.empty_like(i), du.copy(), np.empty(2)
    u[0] = first
    own[:, 0] = 0.0
    for n in range(i.size - 1):
        du[:, n + 1], own[:, n + 1] = du[:, n], own[:, n]
        last = n if step[n] else n + 1
        value, done, slope, event = u[n], 0.0, i[last] - i[n], _MET
        at[0] = i[n]
        while event != _END:
            k = 0 if _rises(at[0] - value, at[0], slope) else 1
            part, event = _piece(at[0] - value, at[0], slope, taus[k] / dt, 1.0 - done)
            at[1] = 0.0 if event == _ZERO else at[0] + part * slope
            e, gone, ramp, by_e, by_ramp = _weights(part * dt, taus[k])
            own[k, n + 1] = e * own[k, n + 1] + by_e * (value - at[0]) + by_ramp * (at[1] - at[0])
            own[1 - k, n + 1] *= e
            value = at[1] if event == _MET else e * value + gone * at[0] + ramp * (at[1] - at[0])
            turned = event == _ZERO and k != (0 if _rises(-value, 0.0, slope) else 1)
            # Where the time changes at a current of zero, what shifts that moment shifts u.
            shift = value * (1.0 / taus[k] - 1.0 / taus[1 - k]) * dt / slope if turned else 0.0
            for j in range(du.shape[0]):
                rise = given[j, last] - given[j, n]
                du[j, n + 1] = e * du[j, n + 1] + gone * (given[j, n] + done * rise) + ramp * part * rise
                du[j, n + 1] += shift * (given[j, n] + (done + part) * rise)
            done += part
            at[0] = at[1]
        u[n + 1] = value
    return u


@njit(cache=True)
def _rises(gap, i, slope):
    """Whether the field rises from here on: `gap` = i − u has the side of i; where one is zero its slope decides."""
    return (gap if gap != 0.0 else slope) * (i if i != 0.0 else slope) > 0.0


@njit(cache=True)
def _piece(gap, i, slope, tau, left):
    """How long one time holds, in shares of the interval as `tau` is, at most what is `left`; and what ends it.

    The gap follows slope·tau + (gap − slope·tau)·e^(−t/tau).
    """
    part, event = left, _END
    if i * slope < 0.0 and -i / slope < part:
        part, event = -i / slope, _ZERO
    if gap * slope < 0.0:
        met = tau * np.log1p(-gap / (slope * tau))
        if met < part:
            part, event = met, _MET
    return part, event


@njit(cache=True)
def _weights(h, tau):
    """e^−y, y = h/tau; the weights of a current and of its rise over the step; slopes of the first and last by tau."""
    y = max(h / tau, 1e-300)
    e, gone = np.exp(-y), -np.expm1(-y)
    return e, gone, 1.0 - gone / y, e * y / tau, (e - gone / y) / tau
