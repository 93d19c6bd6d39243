"""Equations of the sensor path: what each element adds to the force, and the partials by its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE
from identification.models.motion import Motion
from identification.physical.elements.equations.series import follow, leave, means, ramped, slope
from identification.physical.elements.spec import ElementSpec

if TYPE_CHECKING:
    from identification.physical.model import Element

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Added = tuple[Floats, Floats]  # force (N,) and its partials (N, K)
Equation = Callable[[Sequence[float], Motion, Floats, Mask], Added]

ACTS: Final = ("force_offset", "parallel_stiffness")
"""Elements of the sensor path that may be forces of the damper; the others belong to the rig and its load cell."""


def sensor_force(spec: ElementSpec, values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    """What a sensor element adds to `force`, (N,), N, along a motion, and the gradient by its parameters, (N, K).

    Columns of parameters that are not `wanted`, (K,), may be zero.
    """
    return _EQUATIONS[spec.name](values, motion, force, wanted)


def delay_of(spec: ElementSpec, values: Sequence[float]) -> float:
    """How late the element makes the force, s: its inputs are taken from so long ago."""
    return values[0] if spec.name == "force_delay" else 0.0


def ahead_of_current(spec: ElementSpec, values: Sequence[float]) -> float:
    """How late the displacement beside force and current is, s: the current is not taken from so far ahead."""
    return -values[0] if spec.name == "force_delay" and values[3] == 1.0 and values[0] < 0.0 else 0.0


def low_pass_of(spec: ElementSpec, values: Sequence[float]) -> tuple[float, float]:
    """Lag and turn, s, of the low-pass with which the element follows the force before it; see `low_passed`."""
    return (values[1], values[2]) if spec.name == "force_delay" else (0.0, 0.0)


def low_passed(series: Floats, lag: float, turn: float, motion: Motion) -> Floats:
    """What follows `series`, (N,) or (N, K), by y + lag·dy/dt + turn²·d²y/dt² = u, with u linear between samples.

    It starts as a period before has left it where the motion repeats, else as after a long ramp of the first slope,
    u − lag·du/dt.
    """
    out = series.copy()
    rows = out.reshape(out.shape[0], -1)
    low_pass(rows, rows.shape[1], lag, turn, motion)
    return out


def low_pass(series: Floats, columns: int, lag: float, turn: float, motion: Motion) -> None:
    """Put what is `low_passed` of the first `columns` of a series, (N, K), in their place."""
    samples = series.shape[0]
    if max(lag, turn) <= CHANCE.rounding * motion.dt or samples < 2 or not columns:
        return
    by = lag / motion.dt, turn / motion.dt
    b, a = _coefficients(*by)
    mean, state = np.zeros(columns), np.zeros((2, columns))
    if motion.period and samples >= motion.period:
        means(series, motion.period, columns, mean)  # beside its mean a slow filter keeps its digits
        leave(b, a, mean, state, series, motion.period, columns)
        with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the force it ends in
            state = _lasting(*by, motion.period) @ state
    else:
        ramped(b, a, by[0], series, state)
    follow(b, a, mean, state, series, columns)


@lru_cache(maxsize=32)  # of every record of a search
def _lasting(lag: float, turn: float, period: int) -> Floats:
    """What the state that one period leaves, (2,), becomes where all those before were like it: s = M^P·s + what one
    leaves, (2, 2). The least one where the filter forgets nothing in a period."""
    a = _coefficients(lag, turn)[1]
    kept = np.linalg.matrix_power(np.array([[-a[1], 1.0], [-a[2], 0.0]]), period)
    try:
        return np.linalg.inv(np.eye(2) - kept)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(np.eye(2) - kept)


@lru_cache(maxsize=8)  # of the force, of its gradient, and of the next run at that rate
def _coefficients(lag: float, turn: float) -> tuple[Floats, Floats]:
    """Those of the filter that `low_passed` is at samples, (3,) each, the latest first; `lag` and `turn` in samples."""
    from scipy.linalg import expm

    last = [-1.0 / turn**2, -lag / turn**2] if turn > CHANCE.visible * lag else [-1.0 / lag]
    n = len(last)
    # The rates of the state, of the input and of its slope (Franklin, Powell and Workman 1998, section 6.3.2).
    whole = np.eye(n + 2, k=1)
    whole[n - 1, : n + 1] = *last, -last[0]
    step = expm(whole)
    free, held, sloping = step[:n, :n], step[:n, n], step[:n, n + 1]
    a = [1.0, -free[0, 0]] if n == 1 else [1.0, -free[0, 0] - free[1, 1], float(np.exp(last[1]))]
    state, pulse = sloping, [sloping[0]]  # what follows a triangle of one sample on either side
    for k in range(n):
        state = free @ state + (held - sloping if k == 0 else 0.0)
        pulse.append(state[0])
    b = np.convolve(a, pulse)[: n + 1]
    return np.pad(b, (0, 2 - n)), np.pad(np.array(a), (0, 2 - n))


def acting(sensor: Sequence[Element]) -> tuple[float, float]:
    """Offset, N, and stiffness, N/m, of the elements of the sensor path that act on a vehicle."""
    sums = {name: sum(e.parameters[0].value for e in sensor if e.name == name) for name in ACTS}
    return sums["force_offset"], sums["parallel_stiffness"]


def _delay(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    """The delay is already in the inputs and the low-pass in the force; a later force is its slope taken backwards.

    By lag and turn: what follows −dF/dt and −2·turn·d²F/dt².
    """
    _, lag, turn, _ = values
    columns = np.zeros((force.size, len(values)))
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told by the sums of its gradient
        if np.any(wanted):
            columns[:, 0] = -_slope(force, motion)
        if np.any(wanted[1:]):
            columns[:, 1] = columns[:, 0]
            columns[:, 2] = 2.0 * turn * _slope(columns[:, 0], motion)
            columns[:, 1:3] = low_passed(columns[:, 1:3], lag, turn, motion)
    return np.zeros(force.size), columns


def _slope(series: Floats, motion: Motion) -> Floats:
    out = np.zeros(series.size)
    if series.size > 1:
        slope(series, motion.dt, out)
    return out


def _offset(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    return np.full(force.size, values[0]), np.ones((force.size, 1))


def _mass(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    return values[0] * motion.a, motion.a[:, None]


def _parallel_stiffness(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    return values[0] * motion.x, motion.x[:, None]


def _drift(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
    return values[0] * motion.t, motion.t[:, None]


def _hum(values: Sequence[float], motion: Motion, force: Floats, wanted: Mask) -> Added:
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
