"""The points of a running test that a person sees as a loop: consecutive, evenly spaced, with a velocity."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["LiveLoop", "LoopPoints"]

# A loop drawn with n points a period has corners that lie 1 - cos(π/n) of its size inside: 1 % for 22 points. Dampers
# are tested up to about 25 Hz: 500 points a second are enough, and 200 watchers get 200 · 500 · 3 numbers a second.
_POINTS_PER_S = 500.0
# The velocity is the slope of a straight line through the 2m + 1 samples within ±2 ms. With h from sample to sample, it
# shows a sine of frequency f too small by (2πfh)²(3m² + 3m - 1)/30: 1.4 % at 25 Hz for 1 kHz (m = 2). Noise σ of the
# displacement becomes σ/h·√(3/(m(m + 1)(2m + 1))): 0.6 mm/s for 2 µm at 1 kHz, less at higher rates. A difference
# of neighbours would have more there: 5.7 mm/s at 4 kHz.
_HALF_WINDOW_S = 2e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopPoints:
    """Points of one test: every ``step``-th sample from number ``first``; the following ones begin at ``next``."""

    first: int
    step: int
    next: int
    rate_hz: float
    displacement_m: tuple[float, ...]
    velocity_m_s: tuple[float, ...]
    force_n: tuple[float, ...]


@dataclass(slots=True)
class LiveLoop:
    """Makes points of the samples of one test, block by block; a block that does not follow begins anew."""

    rate_hz: float
    _first: int = 0  # number of the first sample kept
    _done: int = 0  # number of the sample after the last one that was considered
    _x: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    _force: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        if not 0 < self.rate_hz < float("inf"):
            raise ValueError(f"rate_hz is {self.rate_hz}: a sample rate is positive")

    @property
    def step(self) -> int:
        """Samples from one point to the next."""
        return max(1, round(self.rate_hz / _POINTS_PER_S))

    @property
    def half_window(self) -> int:
        """Samples on each side of a point that its velocity is taken from."""
        return max(1, round(_HALF_WINDOW_S * self.rate_hz))

    def take(self, first: int, displacement_m: NDArray[np.float64], force_n: NDArray[np.float64]) -> LoopPoints | None:
        """The points that consecutive samples from number ``first``, (n,), complete; None where they complete none."""
        if first != self._first + self._x.size or not self._x.size:
            self._first = self._done = first
            self._x = self._force = np.empty(0)
        self._x, self._force = np.concatenate([self._x, displacement_m]), np.concatenate([self._force, force_n])
        half, step = self.half_window, self.step
        begin = max(self._done, self._first + half)
        begin += -begin % step
        end = self._first + self._x.size - half
        chosen = np.arange(begin, end, step) - self._first
        if not chosen.size:
            return None
        points = self._points(begin, chosen)
        self._done = points.next
        self._forget(points.next - half)
        return points

    def _points(self, begin: int, chosen: NDArray[np.intp]) -> LoopPoints:
        half = self.half_window
        offsets = np.arange(-half, half + 1)
        slope = offsets / np.sum(offsets**2) * self.rate_hz
        velocity = self._x[chosen[:, None] + offsets] @ slope
        return LoopPoints(
            first=begin,
            step=self.step,
            next=begin + chosen.size * self.step,
            rate_hz=self.rate_hz,
            displacement_m=_short(self._x[chosen]),
            velocity_m_s=_short(velocity),
            force_n=_short(self._force[chosen]),
        )

    def _forget(self, number: int) -> None:
        old = max(0, min(number - self._first, self._x.size))
        self._first, self._x, self._force = self._first + old, self._x[old:], self._force[old:]


def _short(values: NDArray[np.float64]) -> tuple[float, ...]:
    """To five digits: a chart shows three, and every watcher is sent all of them."""
    return tuple(float(f"{value:.5g}") for value in values)
