"""How a motion was before its first sample: continued backwards as a linear prediction from its own course."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion

Floats = NDArray[np.float64]

_ORDER = 32  # samples from which the one before them is predicted: some tens describe any motion of a few tones
_FASTEST = 1e3  # m/s: what is faster is no motion of a damper, and its square could overflow
_SEEN = 2000  # samples from which the prediction is learned


def with_past(motion: Motion, signal: str, series: Floats, ahead: int) -> Floats:
    """A signal (N,) of a motion with `ahead` samples before it, (ahead + N,), in its unit.

    A motion that repeats did so before. Of any other the velocity is predicted backwards; displacement and
    acceleration follow from it. Any other signal is held. So a run that begins just after a reversal has that reversal
    in its past, which a force with memory knows.
    """
    if motion.period:
        return np.concatenate([series[np.arange(-ahead, 0) % motion.period], series])
    if signal not in ("displacement", "velocity", "acceleration"):
        return np.concatenate([np.full(ahead, series[0]), series])
    finite = np.clip(np.where(np.isfinite(motion.v), motion.v, 0.0), -_FASTEST, _FASTEST)
    v = predicted_backwards(finite[:_SEEN], ahead)
    if signal == "displacement":
        way = np.concatenate([v, finite[:1]])
        back = series[0] - np.cumsum((0.5 * motion.dt * (way[1:] + way[:-1]))[::-1])[::-1]
    elif signal == "acceleration":
        back = np.gradient(np.concatenate([v, finite[:1]]), motion.dt)[:-1]
    else:
        back = v
    return np.concatenate([back, series])


def predicted_backwards(series: Floats, count: int) -> Floats:
    """The `count` samples before a series (N,), as its linear prediction, (count,).

    The coefficients are Burg's (1975): the prediction never grows.
    """
    order = min(_ORDER, series.size // 4)
    mean = float(np.mean(series))
    reversed_, ahead = series[::-1] - mean, burg(series - mean, order)
    whole = np.concatenate([reversed_[reversed_.size - order :], np.zeros(count)])
    for k in range(order, whole.size):
        whole[k] = ahead @ whole[k - order : k][::-1]
    return mean + whole[order:][::-1]


def burg(series: Floats, order: int) -> Floats:
    """Coefficients of the prediction y(t) = Σ_k c_k·y(t − k), (order,); the same forwards and backwards in time."""
    forward, backward = series[1:], series[:-1]
    error = np.ones(1)
    for _ in range(order):
        power = float(forward @ forward + backward @ backward)
        reflection = -2.0 * float(forward @ backward) / power if power > 0.0 else 0.0
        padded = np.concatenate([error, [0.0]])
        error = padded + reflection * padded[::-1]
        forward, backward = (forward + reflection * backward)[1:], (backward + reflection * forward)[:-1]
    return -error[1:]
