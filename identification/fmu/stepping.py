"""An FMU of a damper from sample to sample."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from identification.fmu_process.live import Opening, Values
from identification.fmu_process.live_process import LiveProcess
from identification.fmu_process.wiring import Wiring
from identification.models.stepping import Moment
from identification.signals import SIGNALS

# How fast the slope of the guess forgets: 0.9 is the last ten samples. 0.5 follows noise, 0.99 a damper of before.
_FORGETS = 0.9


class FmuStepper:
    """An instance of an FMU as a damper. Where it cannot be taken back a sample, `force` is a guess.

    The guess is F + s·(v' − v), s the slope of the last samples, least squares of dF over dv, which are forgotten by
    and by, never below 0.
    """

    def __init__(self, path: Path, wiring: Wiring, dt: float, process: LiveProcess) -> None:
        """A new instance at the step `dt`, s; raises SimulationError."""
        wires = wiring.inputs
        opening = Opening(
            path=path, inputs=tuple(w.variable.name for w in wires), held=tuple(w.channel == "current" for w in wires),
            outputs=(wiring.force.variable.name,), parameters=dict[str, str](wiring.parameters), dt=dt,
        )  # fmt: skip
        self.foresees, self._wiring, self._dt = wiring.back, wiring, dt
        self._series = [(SIGNALS[w.channel], *w.gain()) for w in wires]
        self._instance = process.begin(opening)
        self._v, self._force, self._slope = 0.0, 0.0, [0.0, 0.0]

    @property
    def dt(self) -> float:
        """The step, s."""
        return self._dt

    def start(self, at: Moment) -> float:
        """Begin at a moment that has lasted; the force there, N."""
        self._v, self._force = at.v, self._asked(self._instance.start, at)
        return self._force

    def force(self, at: Moment) -> float:
        """The force if `at` were the next sample, N; a guess where the FMU cannot be taken back."""
        if self.foresees:
            return self._asked(self._instance.tried, at)
        products, squares = self._slope
        slope = max(products / squares, 0.0) if squares > 0.0 else 0.0
        return self._force + slope * (at.v - self._v)

    def advance(self, at: Moment) -> float:
        """Go on to the next sample; the force there, N."""
        force = self._asked(self._instance.taken, at)
        change = at.v - self._v
        self._slope[0] = _FORGETS * self._slope[0] + change * (force - self._force)
        self._slope[1] = _FORGETS * self._slope[1] + change * change
        self._v, self._force = at.v, force
        return force

    def _asked(self, what: Callable[[Values], Values], at: Moment) -> float:
        values = tuple((getattr(at, name) - offset) / factor for name, factor, offset in self._series)
        factor, offset = self._wiring.force.gain()
        return factor * what(values)[0] + offset
