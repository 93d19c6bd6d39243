"""How far the solver's own discretisation carries a simulated force from the exact answer."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion, is_step
from identification.physical.model import Element, Model
from identification.physical.simulate import simulate

Floats = NDArray[np.float64]

_MOST_PARTS = 64
_SMOOTH, _EVENTS = 5, 2  # order of the method for a force that is smooth, and for one that jumps or remembers


@dataclass(frozen=True, slots=True)
class NumericalError:
    """Estimated error of each sample of the force (N,), N, its rms, and that over the rms of the force."""

    force: Floats
    rms: float
    relative: float


@dataclass(frozen=True, slots=True)
class Refined:
    """Force at the samples of a motion (N,), N, its error over its rms, and the parts each sample was divided into.

    The error may stay above what was asked for: 64 parts are the most.
    """

    force: Floats
    relative: float
    parts: int


def numerical_error(model: Model, motion: Motion) -> NumericalError:
    """Error of `simulate(model, motion)` by Richardson's rule from half the step: 2^p/(2^p − 1)·(F_h − F_h/2).

    The method is of order p = 5 where the force is smooth; with dry friction, free play or a memory it is of second
    order, and at a stick, an impact or a reversal of first: the estimate is then a third too small.
    Between samples a periodic motion is its Fourier series, so that near the Nyquist frequency the cubic of the solver
    is part of the error; another motion is that cubic itself.
    """
    motion = replace(motion, settle=0)
    return _compared(model, simulate(model, motion).force, simulate(model, _halved(motion)).force[::2])


def simulate_within(model: Model, motion: Motion, tolerance: float) -> Refined:
    """Force with the samples divided until its estimated error is below `tolerance` times its rms."""
    motion = replace(motion, settle=0)
    coarse, parts, left = simulate(model, motion).force, 1, np.inf
    while left > tolerance and parts < _MOST_PARTS:
        motion, parts = _halved(motion), 2 * parts
        fine = simulate(model, motion).force[::parts]
        left, coarse = _compared(model, coarse, fine).relative / 2.0 ** _order(model), fine
    return Refined(coarse, left, parts)


def _compared(model: Model, coarse: Floats, fine: Floats) -> NumericalError:
    """Error of `coarse` by that of half the step."""
    factor = 2.0 ** _order(model)
    error = (coarse - fine) * factor / (factor - 1.0)
    error[0] = error[1]  # the first sample is a convention, not a step
    rms = float(np.sqrt(np.mean(error**2)))
    return NumericalError(error, rms, rms / max(float(np.sqrt(np.mean(fine**2))), 1e-300))


def _order(model: Model) -> int:
    return _EVENTS if any(_has_events(e) for e in model.elements) else _SMOOTH


def _has_events(e: Element) -> bool:
    """Whether the element makes the force jump, opens a contact, or remembers."""
    jumps = e.spec.smooth_over is not None and e.value(e.spec.smooth_over) == 0.0
    pairs = zip(e.spec.parameters, e.parameters, strict=True)
    play = any(s.place == "gap" or (s.place == "f_slip" and p.value > 0.0) for s, p in pairs)
    return jumps or play or (e.remembers and e.spec.path == "core")


def _halved(motion: Motion) -> Motion:
    """The motion with a sample between every two: of a periodic one the Fourier series, else cubic in x, (2 N − 1,)."""
    dt = motion.dt
    if motion.period:
        x, v, a = (np.resize(_doubled(s[: motion.period]), 2 * motion.x.size) for s in (motion.x, motion.v, motion.a))
        # As they are: the times of a mean period are not the steps of its clock.
        t = np.append(_between(motion.t, 0.5 * _pairs(motion.t)), motion.t[-1] + 0.5 * dt)
        i = np.append(_between(motion.i, _half_way(motion.i)), motion.i[-1])
        warm = np.append(_between(motion.temperature, 0.5 * _pairs(motion.temperature)), motion.temperature[-1])
        return replace(motion, dt=0.5 * dt, x=x, v=v, a=a, i=i, temperature=warm, t=t, period=2 * motion.period)
    return replace(
        motion,
        dt=0.5 * dt,
        x=_between(motion.x, 0.5 * _pairs(motion.x) - dt / 8.0 * np.diff(motion.v)),
        v=_between(motion.v, 1.5 * np.diff(motion.x) / dt - 0.25 * _pairs(motion.v)),
        a=_between(motion.a, np.diff(motion.v) / dt),
        i=_between(motion.i, _half_way(motion.i)),
        temperature=_between(motion.temperature, 0.5 * _pairs(motion.temperature)),
        t=_between(motion.t, 0.5 * _pairs(motion.t)),
        period=0,
    )


def _half_way(i: Floats) -> Floats:
    """The current between every two samples, (N − 1,): the mean of both, and where it steps the first of them still."""
    return np.where(is_step(i), i[:-1], 0.5 * _pairs(i))


def _doubled(period: Floats) -> Floats:
    """One period of a band-limited signal at twice its sample rate."""
    lines = np.fft.rfft(period)
    if period.size % 2 == 0:
        lines[-1] *= 0.5  # the line at the Nyquist frequency was two
    return np.asarray(2.0 * np.fft.irfft(lines, 2 * period.size))


def _pairs(s: Floats) -> Floats:
    return s[1:] + s[:-1]


def _between(s: Floats, middle: Floats) -> Floats:
    out = np.empty(2 * s.size - 1)
    out[::2], out[1::2] = s, middle
    return out
