"""Black boxes and hybrids from sample to sample, by the same compiled loops that simulate them along a motion."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from statistics import median
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.model import check_rate
from identification.blackbox.network import network
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.samples import LEAD, Samples
from identification.blackbox.scaling import LARGEST, Scales
from identification.blackbox.stops import LIMITS, stopped_once
from identification.blackbox.structure import FORCE, MODEL, SYMBOLS, Structure
from identification.models.stepping import Moment, Stepper
from identification.signals import SIGNALS

if TYPE_CHECKING:
    from identification.blackbox.hybrid import Hybrid
    from identification.blackbox.model import BlackBox, Member

Floats = NDArray[np.float64]


class _Lines:
    """One recurrent model with its past: the scaled force of the last samples, and each regressor's line of delays."""

    def __init__(self, structure: Structure, scales: Scales, loop: Callable[[Samples], Callable[[Floats], None]]):
        """`loop` prepares the compiled loop on a window whose last sample alone is simulated."""
        self._structure, self._scales = structure, scales
        size = structure.longest + 1
        begin = np.full(size, size, dtype=np.int64)
        begin[-1] = size - 1
        self._window = Samples(
            inputs=np.zeros((size, len(structure.inputs))),
            force=np.zeros(size),
            begin=begin,
            counted=np.ones(size, dtype=np.bool_),
        )
        self._run, self._out = loop(self._window), np.zeros(size)
        symbols = [one.symbol for one in structure.inputs]
        ahead = ["x"] if LIMITS.keys() & set(symbols) else []  # a stop operator follows the displacement
        self._symbols = list(dict.fromkeys([*ahead, *symbols]))
        self._past: dict[str, deque[float]] = {}

    def start(self, values: dict[str, float]) -> float:
        """Begin at values that have lasted; the scaled force there."""
        size = self._structure.longest + 1
        self._window.force[:] = 0.0
        seen = {
            symbol: 0.0 if symbol in LIMITS else self._seen(SYMBOLS[symbol], values[SYMBOLS[symbol]], 0.0)
            for symbol in self._symbols
        }
        self._past = {symbol: deque([value] * size, maxlen=size) for symbol, value in seen.items()}
        for _ in range(LEAD):
            force = self.advance(values)
        return force

    def force(self, values: dict[str, float]) -> float:
        """The scaled force if these were the next values."""
        now = self._now(values)
        for k, one in enumerate(self._structure.inputs):
            self._window.inputs[-1, k] = now[one.symbol] if one.delay == 0 else self._past[one.symbol][-one.delay]
        self._run(self._out)
        return float(self._out[-1])

    def advance(self, values: dict[str, float]) -> float:
        """Go on to these values; the scaled force there."""
        force = self.force(values)
        for symbol, value in self._now(values).items():
            self._past[symbol].append(value)
        known = self._window.force
        known[:-1] = known[1:]
        if known.size > 1:
            known[-2] = force
        return force

    def _now(self, values: dict[str, float]) -> dict[str, float]:
        """What the network sees of these values, by symbol; the displacement comes before its stop operators."""
        now: dict[str, float] = {}
        for symbol, past in self._past.items():
            if symbol in LIMITS:
                now[symbol] = stopped_once(past[-1], now["x"] - self._past["x"][-1], LIMITS[symbol])
            else:
                now[symbol] = self._seen(SYMBOLS[symbol], values[SYMBOLS[symbol]], past[-1])
        return now

    def _seen(self, name: str, value: float, before: float) -> float:
        """As `scaling.seen`: scaled, held where it is not finite, cut at the edges."""
        if not math.isfinite(value):
            return before
        scale = self._scales[name]
        low, high = scale.told_apart
        return (min(max(value, low), high) - scale.centre) / scale.size


class BlackBoxStepper:
    """The median of what the members of a black box, or one polynomial, give from sample to sample."""

    def __init__(self, name: str, trained_dt: float, dt: float, scales: Scales, lines: Sequence[_Lines]) -> None:
        """Before its start; raises SimulationError where the step is not the sample interval of the training."""
        check_rate(name, trained_dt, dt)
        self._dt, self._force, self._lines = dt, scales[FORCE], lines

    @property
    def dt(self) -> float:
        """The step, s."""
        return self._dt

    def start(self, at: Moment, model: float = 0.0) -> float:
        """Begin at a moment that has lasted; `model` is the force, N, of the model that a hybrid builds on."""
        return self._median([one.start(_values(at, model)) for one in self._lines])

    def force(self, at: Moment, model: float = 0.0) -> float:
        """The force if `at` were the next sample, N: nothing is kept."""
        values = _values(at, model)
        return self._median([one.force(values) for one in self._lines])

    def advance(self, at: Moment, model: float = 0.0) -> float:
        """Go on to the next sample; the force there, N."""
        values = _values(at, model)
        return self._median([one.advance(values) for one in self._lines])

    def _median(self, scaled: Sequence[float]) -> float:
        return median(scaled) * self._force.size + self._force.centre


def _values(at: Moment, model: float) -> dict[str, float]:
    return {name: getattr(at, series) for name, series in SIGNALS.items()} | {MODEL: model}


def blackbox_stepper(model: BlackBox, dt: float) -> BlackBoxStepper:
    """A black box from sample to sample; raises SimulationError where `dt` is not the interval of its training."""
    lines = [_Lines(member.structure, model.scales, _loop_of(member, model.scales)) for member in model.members]
    return BlackBoxStepper(model.name, model.dt, dt, model.scales, lines)


def polynomial_stepper(model: PolynomialNarx, dt: float) -> BlackBoxStepper:
    """A polynomial from sample to sample; raises SimulationError where `dt` is not the interval of its training."""

    lines = [_Lines(model.structure, model.scales, model.prepared)]
    return BlackBoxStepper(model.name, model.dt, dt, model.scales, lines)


def _loop_of(member: Member, scales: Scales) -> Callable[[Samples], Callable[[Floats], None]]:
    found = network(member.structure, scales)
    return lambda samples: found.prepared(member.weights, samples, None).simulate


def _cut(force: float) -> float:
    """The force of a base as a hybrid takes it: within what a machine can have."""
    return min(max(force, -LARGEST), LARGEST)


class HybridStepper:
    """F = F_base + w·F_rest from sample to sample; an input that is no number is held for both, as along a motion."""

    def __init__(self, model: Hybrid, base: Stepper, rest: BlackBoxStepper) -> None:
        """From the steppers of both parts at one step."""
        self._model, self._base, self._rest = model, base, rest
        self._last = Moment()

    @property
    def dt(self) -> float:
        """The step, s."""
        return self._base.dt

    def start(self, at: Moment) -> float:
        """Begin at a moment that has lasted; the force there, N."""
        self._last = at = at.held(Moment())
        base = _cut(self._base.start(at))
        return base + self._model.weight(at) * self._rest.start(at, base)

    def force(self, at: Moment) -> float:
        """The force if `at` were the next sample, N: nothing is kept."""
        at = at.held(self._last)
        base = _cut(self._base.force(at))
        return base + self._model.weight(at) * self._rest.force(at, base)

    def advance(self, at: Moment) -> float:
        """Go on to the next sample; the force there, N."""
        self._last = at = at.held(self._last)
        base = _cut(self._base.advance(at))
        return base + self._model.weight(at) * self._rest.advance(at, base)
