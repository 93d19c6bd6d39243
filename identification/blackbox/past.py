"""How a motion was before its first sample: continued backwards as a linear prediction from its own course."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion

Floats = NDArray[np.float64]

# The velocity is predicted from means over some samples each, so that the prediction sees two and a half cycles however
# fast the motion was sampled. Measured by the squared error of stop operators over the first 80 samples of a random
# motion of 0.3 to 10 Hz at 200 Hz, for r of 0.3 and 1 rms of the displacement: 32 single samples 2.8 and 13; 100 means,
# 40 in a cycle: 1.8 and 7.1; 20 in a cycle: 2.5 and 6.8; 32 of 40 in a cycle: 2.3 and 9.7. On sines all are the same.
_ORDER = 100
_A_CYCLE = 40.0
# A tenth of a cycle within 5 % of the rms velocity is rest: a tenth of a cycle from its turn on a sine has 80 % of it.
_BEGINS, _AT_REST = 0.1, 0.05

# White noise that a prediction allows for, of the power of the motion: some hundred times the rounding of its sums.
# Without it a smooth motion is continued from its rounding: before one of 130 places of measured and simulated records
# it was 18 times as fast as the motion. Squared error of the velocity over the 200 samples before them, of its power:
# 0.92 or more without, 0.27 with it, and with up to 10⁸ times as much.
_WHITE = 1e-13

# Means that are left out at the begin of a run, one more at a time, while the motion before it is faster than
# `_FASTER` times the run. One that starts with a jerk, as of a machine that is switched on, does not show by it what
# was before: so continued, it was up to four times as fast as all that followed. Eight are a fifth of a cycle. Of 2 622
# places in those records the second before was faster than all that followed in 22 %, 1.5 times as fast in 0.7 %.
_LEFT_OUT, _FASTER = (0, 1, 2, 4, 8), 1.5

_SEEN = 2000  # means from which the prediction is learned
_FASTEST = 1e3  # m/s: what is faster is no motion of a damper, and its square could overflow


def with_past(motion: Motion, signal: str, series: Floats, before: Floats) -> Floats:
    """A signal (N,) of a motion with the samples before it, (ahead + N,), in its unit.

    `before` (ahead,) is the velocity before it, of `velocity_before`. A motion that repeats did so before. Of any other
    displacement and acceleration follow from that velocity; any other signal is held. So a run that begins just after a
    reversal has that reversal in its past, which a force with memory knows.
    """
    ahead = before.size
    if not ahead:
        return series
    if motion.period:
        return np.concatenate([series[np.arange(-ahead, 0) % motion.period], series])
    if signal not in ("displacement", "velocity", "acceleration"):
        return np.concatenate([np.full(ahead, series[0]), series])
    way = np.concatenate([before, _finite(motion.v[:1])])
    if signal == "displacement":
        back = series[0] - np.cumsum((0.5 * motion.dt * (way[1:] + way[:-1]))[::-1])[::-1]
    elif signal == "acceleration":
        back = np.gradient(way, motion.dt)[:-1]
    else:
        back = before
    return np.concatenate([back, series])


def velocity_before(motion: Motion, ahead: int) -> Floats:
    """The velocity of the `ahead` samples before a motion, m/s; a motion that begins at rest was at rest."""
    if not ahead:
        return np.zeros(0)
    if motion.period:
        return np.asarray(motion.v[np.arange(-ahead, 0) % motion.period])
    if begins_at_rest(motion):
        return np.zeros(ahead)
    v = _finite(motion.v)
    cycle = _cycle(v)
    size = max(1, int(cycle / _A_CYCLE))
    most, before = _FASTER * float(np.max(np.abs(v))), np.zeros(ahead)
    for first in (size * count for count in _LEFT_OUT if size * count < v.size):
        before = predicted_backwards(v[first : first + _SEEN * size], ahead + first, size)[:ahead]
        if np.max(np.abs(before), initial=0.0) <= most:
            break
    return before


def begins_at_rest(motion: Motion) -> bool:
    """Whether a motion rests for the first tenth of a cycle: then it was at rest before it."""
    v = _finite(motion.v)
    return bool(np.max(np.abs(v[: max(1, int(_BEGINS * _cycle(v)))])) < _AT_REST * np.std(v))


def predicted_backwards(series: Floats, count: int, size: int = 1) -> Floats:
    """The `count` samples before a series (N,), as the linear prediction of its means over `size` samples, (count,).

    The coefficients are Burg's (1975): the prediction never grows, and far back it is 0, as a damper goes nowhere on
    average. Between the centres of the means it is a line.
    """
    size = min(size, max(1, series.size // 4))
    means = series[: series.size // size * size].reshape(-1, size).mean(axis=1)
    order, further = min(_ORDER, means.size // 4), -(-count // size) + 1
    whole = np.concatenate([means[:order][::-1], np.zeros(further)])
    ahead = burg(means, order)[::-1]
    for k in range(order, whole.size):
        whole[k] = ahead @ whole[k - order : k]
    ago = np.concatenate([[0.0], size * (np.arange(further) + 0.5) + 0.5])  # samples before the first one
    values = np.concatenate([series[:1], whole[order:]])
    return np.asarray(np.interp(np.arange(count, 0, -1), ago, values))


def burg(series: Floats, order: int) -> Floats:
    """Coefficients of the prediction y(t) = Σ_k c_k·y(t − k), (order,); the same forwards and backwards in time."""
    forward, backward = series[1:], series[:-1]
    error = np.ones(1)
    floor = _WHITE * float(forward @ forward + backward @ backward)
    for _ in range(order):
        power = float(forward @ forward + backward @ backward) + floor
        reflection = -2.0 * float(forward @ backward) / power if power > 0.0 else 0.0
        padded = np.concatenate([error, [0.0]])
        error = padded + reflection * padded[::-1]
        forward, backward = (forward + reflection * backward)[1:], (backward + reflection * forward)[:-1]
    return -error[1:]


def _finite(v: Floats) -> Floats:
    return np.asarray(np.clip(np.where(np.isfinite(v), v, 0.0), -_FASTEST, _FASTEST))


def _cycle(v: Floats) -> float:
    """Samples of a typical cycle of a motion: 2π times the ratio of the rms of its way to that of its velocity."""
    way = np.cumsum(v - v.mean())
    line = np.arange(way.size) - 0.5 * (way.size - 1)
    power = float(line @ line)
    way -= way.mean()
    way -= (float(way @ line) / power if power > 0.0 else 0.0) * line
    rms = float(np.std(v))
    return 2.0 * np.pi * float(np.std(way)) / rms if rms > 0.0 else 1.0
