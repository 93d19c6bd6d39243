"""Equations of the sensor path: what each element adds to the force, and the partials by its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.elements.spec import ElementSpec

if TYPE_CHECKING:
    from identification.physical.model import Element

Floats = NDArray[np.float64]
Added = tuple[Floats, Floats]  # force (N,) and its partials (N, K)
Equation = Callable[[Sequence[float], Motion, Floats], Added]

ACTS: Final = ("force_offset", "parallel_stiffness")
"""Elements of the sensor path that may be forces of the damper; the others belong to the rig and its load cell."""


def sensor_force(spec: ElementSpec, values: Sequence[float], motion: Motion, force: Floats) -> Added:
    """What a sensor element adds to `force`, (N,), N, along a motion, and the gradient by its parameters, (N, K)."""
    return _EQUATIONS[spec.name](values, motion, force)


def delay_of(spec: ElementSpec, values: Sequence[float]) -> float:
    """How late the element makes the force, s: its inputs are taken from so long ago."""
    return values[0] if spec.name == "force_delay" else 0.0


def lag_of(spec: ElementSpec, values: Sequence[float]) -> float:
    """Time constant with which the element follows the force before it, s; see `lagged`."""
    return values[1] if spec.name == "force_delay" else 0.0


def lagged(series: Floats, lag: float, motion: Motion) -> Floats:
    """What follows `series`, (N,) or (N, K), with a lag in s: y + lag·dy/dt = u, with u linear between samples.

    y[n] = q·y[n−1] + (g − q)·u[n−1] + (1 − g)·u[n], q = e^(−h/lag), g = (1 − q)·lag/h. It starts as a period before has
    left it where the motion repeats, else as after a long ramp of the first slope.
    """
    if lag <= 0.0 or series.shape[0] < 2:
        return series
    from scipy.signal import lfilter  # 0.3 s to import: only where it is needed

    h = motion.dt
    q = float(np.exp(-h / lag))
    g = (1.0 - q) * lag / h
    b, a = (1.0 - g, g - q), (1.0, -q)
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the force it ends in
        if motion.period and series.shape[0] >= motion.period:
            one = series[: motion.period]
            first, _ = lfilter(b, a, one, axis=0, zi=((g - q) * one[-1])[None])
            state = (g - q) * one[-1] + q * first[-1] / (1.0 - q**motion.period)
        else:
            before = 2.0 * series[0] - series[1]
            state = (g - q) * before + q * (before - lag * (series[1] - series[0]) / h)
        return np.asarray(lfilter(b, a, series, axis=0, zi=state[None])[0])


def acting(sensor: Sequence[Element]) -> tuple[float, float]:
    """Offset, N, and stiffness, N/m, of the elements of the sensor path that act on a vehicle."""
    sums = {name: sum(e.parameters[0].value for e in sensor if e.name == name) for name in ACTS}
    return sums["force_offset"], sums["parallel_stiffness"]


def _delay(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    """The delay is already in the inputs and the lag in the force; a later force is its slope taken backwards.

    By the lag: lag·ds/dt + s = −dF/dt.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the sums of its gradient
        rate = np.gradient(force, motion.dt)
        later = lagged(rate, values[1], motion)
    return np.zeros(force.size), -np.stack([rate, later], axis=1)


def _offset(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    return np.full(force.size, values[0]), np.ones((force.size, 1))


def _mass(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    return values[0] * motion.a, motion.a[:, None]


def _parallel_stiffness(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    return values[0] * motion.x, motion.x[:, None]


def _drift(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    return values[0] * motion.t, motion.t[:, None]


def _hum(values: Sequence[float], motion: Motion, force: Floats) -> Added:
    amplitude, frequency, phase = values
    angle = 2.0 * np.pi * frequency * motion.t + phase
    by_frequency = amplitude * 2.0 * np.pi * motion.t * np.cos(angle)
    columns = np.stack([np.sin(angle), by_frequency, amplitude * np.cos(angle)], axis=1)
    return amplitude * np.sin(angle), columns


_EQUATIONS: Final[Mapping[str, Equation]] = {
    "force_delay": _delay,
    "force_offset": _offset,
    "moving_mass": _mass,
    "parallel_stiffness": _parallel_stiffness,
    "force_drift": _drift,
    "mains_hum": _hum,
}
