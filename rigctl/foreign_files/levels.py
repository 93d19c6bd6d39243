"""Sections of a record in which the motion repeats: levels of a staircase, or frequencies of a stepped sweep."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind

__all__ = ["Level", "levels_of"]

Floats = NDArray[np.float64]

# Share by which length, amplitude and rms of the cycles of a level may differ: machines hold 1 or 2 %. Half: a machine
# of uneven speed has no level; double: cycles count with which a machine starts and stops.
_ALIKE: Final = 0.03
_LEAST_CYCLES: Final = 3  # one to settle, two to compare
_TURN: Final = 0.01  # of the whole stroke: a smaller way back is noise, and no reversal
_PURE: Final = 0.97  # share of the power in the first harmonics of a sine
_THIRD: Final = (0.08, 0.14)  # third harmonic of a triangle over its first: 1/9


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """Whole cycles of one frequency and amplitude: samples from ``start`` to before ``stop``."""

    start: int
    stop: int
    cycles: int
    frequency_hz: float
    amplitude_m: float
    kind: str

    def __str__(self) -> str:
        return f"{self.frequency_hz:.3g} Hz, {1e3 * self.amplitude_m:.3g} mm, {self.cycles} cycles"


def levels_of(x: Floats, rate_hz: float) -> tuple[Level, ...]:
    """The levels of a displacement, (N,), m, in their order; what lies between them belongs to none.

    A cycle lasts from one crossing of the middle of a stroke to the next in the same direction.
    """
    times, features = _cycles(x)
    found, first = [], 0
    for k in range(1, len(features) + 1):
        if k < len(features):
            usual = features[first:k].mean(axis=0)
            if np.all(np.abs(features[k] - usual) <= _ALIKE * usual):
                continue
        if k - first >= _LEAST_CYCLES:
            found.append(_level(x, rate_hz, times[first : k + 1], float(features[first:k, 1].mean())))
        first = k
    return tuple(found)


def _level(x: Floats, rate_hz: float, times: Floats, amplitude: float) -> Level:
    start, stop = int(np.ceil(times[0])), int(np.ceil(times[-1]))
    frequency = (times.size - 1) * rate_hz / float(times[-1] - times[0])
    kind = _kind(x[start:stop], frequency / rate_hz)
    return Level(
        start=start,
        stop=stop,
        cycles=times.size - 1,
        frequency_hz=frequency,
        amplitude_m=amplitude,
        kind=kind,
    )


def _cycles(x: Floats) -> tuple[Floats, Floats]:
    """Times of upward crossings of the middle, in samples, (K + 1,); length, amplitude and rms of the cycles, (K, 3).

    A cycle with a rest in it has a smaller rms.
    """
    turns = _turns(x)
    times = [_crossing(x, a, b) for a, b in pairwise(turns.tolist()) if x[b] > x[a]]
    features = []
    for begin, end in pairwise(times):
        cycle = x[round(begin) : round(end) + 1]
        middle, span = 0.5 * (cycle.max() + cycle.min()), float(np.ptp(cycle))
        features.append((end - begin, 0.5 * span, float(np.sqrt(np.mean((cycle - middle) ** 2)))))
    return np.array(times), np.array(features).reshape(-1, 3)


def _crossing(x: Floats, low: int, high: int) -> float:
    middle = 0.5 * (x[low] + x[high])
    k = low + int(np.argmax(x[low : high + 1] >= middle))
    if k == low or x[k] == x[k - 1]:
        return float(k)
    return float(k - 1 + (middle - x[k - 1]) / (x[k] - x[k - 1]))


def _turns(x: Floats) -> NDArray[np.int64]:
    """Samples at which the motion reverses by more than noise."""
    least = _TURN * float(np.ptp(x))
    steps = np.sign(np.diff(x))
    extremes = np.flatnonzero(np.diff(steps) != 0.0) + 1
    turns: list[int] = []
    rising = 0
    for k in np.concatenate([[0], extremes, [x.size - 1]]).tolist():
        if not turns:
            turns.append(k)
            continue
        way = x[k] - x[turns[-1]]
        if rising and way * rising >= 0.0:
            turns[-1] = k  # goes on in the same direction
        elif abs(way) > least:
            turns.append(k)
            rising = 1 if way > 0.0 else -1
    return np.array(turns, dtype=np.int64)


def _kind(x: Floats, frequency: float) -> str:
    """Sine, triangle or custom, by the harmonics of whole cycles; ``frequency`` in cycles a sample."""
    angle = 2.0 * np.pi * frequency * np.arange(x.size)
    lines = [2.0 * abs(np.mean((x - x.mean()) * np.exp(-1j * k * angle))) for k in (1, 2, 3)]
    variance = float(np.var(x))
    if variance == 0.0 or sum(0.5 * line**2 for line in lines) < _PURE * variance:
        return Kind.CUSTOM
    if _THIRD[0] < lines[2] / lines[0] < _THIRD[1]:
        return Kind.TRIANGLE
    return Kind.SINE if 0.5 * lines[0] ** 2 > 0.9 * variance else Kind.CUSTOM
