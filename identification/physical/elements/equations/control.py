"""Equations of the control path: from the measured current i to the effective current u, with sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.models.motion import delayed, is_step
from identification.physical.elements.equations.coil import coil_loop

if TYPE_CHECKING:
    from identification.physical.model import Element

Floats = NDArray[np.float64]

_SHORTEST = 1e-9  # time of a lag over the time between samples


@dataclass(frozen=True, slots=True)
class Clock:
    """What an element of the control path may need beside the current."""

    dt: float
    period: int  # samples; 0 where the current does not repeat
    remanence: float


Apply = Callable[[Floats, Floats, Floats, Sequence[float], Clock], Floats]
"""(u, du, own, values, clock): u (N,) after the element; in place it changes du (C, N) and fills own (K, N), ∂u by each
of its K parameters."""


def effective_current(
    elements: Sequence[Element], i: Floats, dt: float, period: int, remanence: float = 0.0
) -> tuple[Floats, Floats]:
    """Effective current and its sensitivities to every control parameter, in order.

    `remanence` in −1 … 1 is where a hysteresis stands at the first sample, between the two edges of its width.
    Returns u (N,), A, and du (C, N), A per unit of each of the C parameters.
    """
    u, clock = i.copy(), Clock(dt, period, remanence)
    du = np.zeros((sum(len(e.parameters) for e in elements), i.size))
    at = 0
    for e in elements:
        end = at + len(e.parameters)
        u = _APPLY[e.name](u, du[:at], du[at:end], [p.value for p in e.parameters], clock)
        at = end
    return u, du


def _lag(u: Floats, du: Floats, own: Floats, values: Sequence[float], clock: Clock) -> Floats:
    if values[1] > 0.0:
        return _coil(u, du, own, values, clock)
    tau = max(values[0], _SHORTEST * clock.dt)
    return np.asarray(_lag_loop(u, is_step(u), du, own[0], tau, clock.dt))


@njit(cache=True)
def _lag_loop(i: Floats, step: NDArray[np.bool_], du: Floats, own: Floats, tau: float, dt: float) -> Floats:
    """du/dt = (i − u)/tau, exact for a current that is linear between samples, or held where it steps."""
    y = dt / tau
    e = np.exp(-y)
    de = e * y / tau
    ramp = 1.0 - (1.0 - e) / y
    dramp = (de - (1.0 - e) / tau) / y
    u = np.empty_like(i)
    u[0] = i[0]
    own[0] = 0.0
    before = du[:, 0].copy()
    for n in range(i.size - 1):
        slope = 0.0 if step[n] else i[n + 1] - i[n]
        u[n + 1] = e * u[n] + (1.0 - e) * i[n] + ramp * slope
        own[n + 1] = e * own[n] + de * (u[n] - i[n]) + dramp * slope
        for j in range(du.shape[0]):
            now = du[j, n + 1]
            rise = 0.0 if step[n] else now - before[j]
            du[j, n + 1] = e * du[j, n] + (1.0 - e) * before[j] + ramp * rise
            before[j] = now
    return u


def _coil(u: Floats, du: Floats, own: Floats, values: Sequence[float], clock: Clock) -> Floats:
    rise, fall = (max(tau, _SHORTEST * clock.dt) for tau in values)
    return np.asarray(coil_loop(u[0], u, is_step(u), du, own, (rise, fall), clock.dt))


def _delay(u: Floats, du: Floats, own: Floats, values: Sequence[float], clock: Clock) -> Floats:
    tau, dt, period = values[0], clock.dt, clock.period
    late = delayed(u, tau, dt, period)
    later, earlier = delayed(u, tau + 0.5 * dt, dt, period), delayed(u, max(tau - 0.5 * dt, 0.0), dt, period)
    own[0] = (later - earlier) / (0.5 * dt + min(tau, 0.5 * dt))
    for row in du:
        row[:] = delayed(row, tau, dt, period)
    return late


def _saturation(u: Floats, du: Floats, own: Floats, values: Sequence[float], clock: Clock) -> Floats:
    i_s = values[0]
    th = np.tanh(u / i_s)
    slope = 1.0 - th**2
    own[0] = th - u / i_s * slope
    du *= slope
    return np.asarray(i_s * th)


def _hysteresis(u: Floats, du: Floats, own: Floats, values: Sequence[float], clock: Clock) -> Floats:
    return np.asarray(_play_loop(u, du, own[0], values[0], clock.remanence))


@njit(cache=True)
def _play_loop(i: Floats, du: Floats, own: Floats, width: float, remanence: float) -> Floats:
    """Play operator: u stays until i has moved half the width away from it."""
    half = 0.5 * width
    u = np.empty_like(i)
    u[0] = i[0] + remanence * half
    own[0] = 0.5 * remanence
    for n in range(1, i.size):
        if i[n] - half > u[n - 1]:
            u[n] = i[n] - half
            own[n] = -0.5
        elif i[n] + half < u[n - 1]:
            u[n] = i[n] + half
            own[n] = 0.5
        else:
            u[n] = u[n - 1]
            own[n] = own[n - 1]
            for j in range(du.shape[0]):
                du[j, n] = du[j, n - 1]
    return u


_APPLY: Final[Mapping[str, Apply]] = {
    "control_lag": _lag,
    "coil_lag": _coil,
    "control_delay": _delay,
    "control_saturation": _saturation,
    "control_hysteresis": _hysteresis,
}
