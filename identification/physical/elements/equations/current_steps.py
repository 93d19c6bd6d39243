"""The control path from sample to sample: the equations of `control.py` for a current that is not known ahead.

Between samples the current is linear, and before the first it was what it is there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from identification.physical.elements.equations.coil import coil_loop

if TYPE_CHECKING:
    from identification.physical.model import Element

_NO_STEP: Final = np.zeros(1, dtype=np.bool_)

State = tuple[float, ...]
Step = Callable[[float, State, Sequence[float], float], tuple[float, State]]
"""(current, state, values of the parameters, dt) to the current after the element, A, and its new state."""


class CurrentPath:
    """The elements of a control path with their states."""

    def __init__(self, elements: Sequence[Element], dt: float) -> None:
        """A path at the step `dt`, s, before its first current."""
        self._rows = [(_STEPS[e.name], [p.value for p in e.parameters]) for e in elements]
        self._dt = dt
        self._states: list[State] = [()] * len(self._rows)

    def start(self, i: float) -> float:
        """Begin at a current that has lasted; the effective current."""
        self._states = [()] * len(self._rows)
        return self.advance(i)

    def next(self, i: float) -> float:
        """The effective current if `i` were the next: nothing is kept."""
        return self._through(i)[0]

    def advance(self, i: float) -> float:
        """Go on to the current `i`; the effective current."""
        u, self._states = self._through(i)
        return u

    def _through(self, i: float) -> tuple[float, list[State]]:
        states = []
        for (step, values), state in zip(self._rows, self._states, strict=True):
            i, new = step(i, state, values, self._dt)
            states.append(new)
        return i, states


def _lag(i: float, state: State, values: Sequence[float], dt: float) -> tuple[float, State]:
    if values[1] > 0.0:
        return _coil(i, state, values, dt)
    if not state:
        return i, (i, i)
    u, before = state
    y = dt / max(values[0], 1e-9 * dt)
    e = math.exp(-y)
    u = e * u + (1.0 - e) * before + (1.0 - (1.0 - e) / y) * (i - before)
    return u, (u, i)


def _coil(i: float, state: State, values: Sequence[float], dt: float) -> tuple[float, State]:
    if not state:
        return i, (i, i)
    u, before = state
    rise, fall = (max(tau, 1e-9 * dt) for tau in values)
    u = float(coil_loop(u, np.array([before, i]), _NO_STEP, np.zeros((0, 2)), np.zeros((2, 2)), (rise, fall), dt)[1])
    return u, (u, i)


def _delay(i: float, state: State, values: Sequence[float], dt: float) -> tuple[float, State]:
    """The state holds the currents of the delay and one more, the oldest first."""
    back = values[0] / dt
    whole = math.floor(back + 1e-9)
    past = (*state[1:], i) if state else (i,) * (whole + 2)
    q = max(back - whole, 0.0)
    return (1.0 - q) * past[1] + q * past[0], past


def _saturation(i: float, state: State, values: Sequence[float], dt: float) -> tuple[float, State]:
    i_s = values[0]
    return i_s * math.tanh(i / i_s), ()


def _hysteresis(i: float, state: State, values: Sequence[float], dt: float) -> tuple[float, State]:
    half = 0.5 * values[0]
    u = min(max(state[0] if state else i, i - half), i + half)
    return u, (u,)


_STEPS: Final[Mapping[str, Step]] = {
    "control_lag": _lag,
    "coil_lag": _coil,
    "control_delay": _delay,
    "control_saturation": _saturation,
    "control_hysteresis": _hysteresis,
}
