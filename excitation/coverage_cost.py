"""How unevenly samples fill a box or an ellipse, as a smooth function of the phases, with its gradient."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from excitation.portable_math import cosine_and_sine

if TYPE_CHECKING:
    from excitation.periodic import Multitone

__all__ = ["Axis", "CoverageCost", "Modes", "SoftLimit", "plain_modes"]

_CHUNKS = 8  # fixed, so that sums do not depend on how many threads work
_MANY = 2**16  # samples from which threads pay


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axis:
    """One variable of the working range: a linear function of the phases' cosines, in half boxes.

    u[n] = Σ A_k cos(2π(k n/N + φ_k + offset)), with rms 1/√3: a uniform distribution over ±1 has that rms (1/2 on an
    axis of the unit disc).
    """

    tones: int  # index of its multitone
    amplitude: NDArray[np.float64]  # (K,)
    offset_turns: float | NDArray[np.float64]  # (K,) behind a rig


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoftLimit:
    """A limited quantity that is not covered: samples beyond ``limit`` half boxes add to the cost."""

    axis: Axis
    limit: float
    weight: float
    every: int = 1  # step through the samples of the axes: fewer show a slow quantity as well


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Modes:
    """Weight of each squared cosine mode, and the modes of the distribution that is wanted; (modes, modes[, modes])."""

    weight: NDArray[np.float64]
    target: NDArray[np.float64] | None = None  # None: even over the box
    disc: tuple[int, int] | None = None  # axes that fill a disc


def plain_modes(modes: int, dimensions: int) -> Modes:
    """The squared relative deviation from an even filling of the box, by Parseval's theorem, up to ``modes``."""
    return Modes(weight=_weight(modes, dimensions))


class CoverageCost:
    """Value and gradient over the joined phases of all multitones."""

    def __init__(
        self,
        tones: Sequence[Multitone],
        axes: Sequence[Axis],
        soft: Sequence[SoftLimit],
        modes: Modes,
        every: int,
        outside: float,
        threads: int | None = None,
        edge: float = 1.0,
    ) -> None:
        self.samples = tones[0].period_samples // every
        self.lines = [t.lines for t in tones]
        self.axes, self.soft, self.modes = list(axes), list(soft), modes
        self.last_value, self.threads = np.inf, threads
        self.edge = edge  # of the box, in half boxes: what lies beyond counts as outside
        self.outside = outside  # weight of what lies outside the box or disc, relative to the sum of squared modes
        ends = np.cumsum([line.size for line in self.lines])
        self.parts = [slice(int(e) - line.size, int(e)) for e, line in zip(ends, self.lines, strict=True)]

    def split(self, phases: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        return tuple(phases[part] - np.floor(phases[part]) for part in self.parts)

    def signals(self, phases: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """The samples of each axis, in half boxes."""
        return [self._synthesise(axis, phases)[0] for axis in self.axes]

    def value_and_gradient(self, phases: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        made = self._map(self.axes, lambda axis: self._synthesise(axis, phases))
        signals = [signal for signal, _ in made]
        value, slopes = self._uniformity(signals)
        gradient = np.zeros_like(phases)
        charges, extras = self._outside(signals)
        for slope, extra in zip(slopes, extras, strict=True):
            slope += extra
        places = list(range(len(self.axes)))
        steep = self._map(places, lambda n: self._by_phase(self.axes[n], made[n][1], slopes[n]))
        beyond = self._map(self.soft, lambda quantity: self._beyond(quantity, phases))
        for axis, charge, change in zip(self.axes, charges, steep, strict=True):
            value += charge
            gradient[self.parts[axis.tones]] -= change
        for quantity, (charge, change) in zip(self.soft, beyond, strict=True):
            if change is not None:
                value += charge
                gradient[self.parts[quantity.axis.tones]] -= change
        self.last_value = value
        return value, gradient

    def _beyond(self, quantity: SoftLimit, phases: NDArray[np.float64]) -> tuple[float, NDArray[np.float64] | None]:
        """Cost of the samples beyond a soft limit and its derivative by the phases, (K,); None where none is beyond."""
        signal, turned = self._synthesise(quantity.axis, phases, quantity.every)
        charge, extra = _excess_cost(signal, quantity.limit, quantity.weight)
        return charge, self._by_phase(quantity.axis, turned, extra) if charge > 0.0 else None

    def _outside(self, signals: list[NDArray[np.float64]]) -> tuple[list[float], list[NDArray[np.float64]]]:
        """Cost of the samples outside, and its derivative by each sample, of each axis."""
        made = [_excess_cost(signal, self.edge, self.outside) for signal in signals]
        charges, extras = [charge for charge, _ in made], [extra for _, extra in made]
        if self.modes.disc is not None:
            first, second = self.modes.disc
            charges[first], extras[first], extras[second] = _disc_cost(signals[first], signals[second], self.outside)
            charges[second] = 0.0
        return charges, extras

    def _synthesise(
        self, axis: Axis, phases: NDArray[np.float64], every: int = 1
    ) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], NDArray[np.float64]]]:
        cos, sin = cosine_and_sine(phases[self.parts[axis.tones]] + axis.offset_turns)
        real, imaginary = axis.amplitude * cos, axis.amplitude * sin
        samples = self.samples // every
        spectrum = np.zeros(samples // 2 + 1, dtype=np.complex128)
        spectrum.real[self.lines[axis.tones]] = 0.5 * real
        spectrum.imag[self.lines[axis.tones]] = 0.5 * imaginary
        return np.fft.irfft(spectrum, n=samples, norm="forward"), (real, imaginary)

    def _by_phase(
        self, axis: Axis, turned: tuple[NDArray[np.float64], NDArray[np.float64]], slope: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """−∂/∂φ_k = 2π A_k Im(e^{jφ} conj(G_k)), (K,), G the DFT of the slopes over the samples."""
        real, imaginary = turned
        g = np.fft.rfft(slope)[self.lines[axis.tones]]
        return np.asarray(2.0 * np.pi * (imaginary * g.real - real * g.imag))

    def _map(self, items: Sequence[Any], work: Callable[[Any], Any]) -> list[Any]:
        """Any: what is worked on, and what comes of it. Threads only where there are many samples."""
        if len(items) == 1 or self.samples < _MANY:
            return [work(item) for item in items]
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(work, items))

    def _uniformity(self, signals: list[NDArray[np.float64]]) -> tuple[float, list[NDArray[np.float64]]]:
        # imported here because numba takes long to load
        from excitation.modes import gradient_2d, gradient_3d, sums_2d, sums_3d

        chunks = _chunks(self.samples)
        slopes = [np.empty(self.samples) for _ in signals]
        sums: Callable[..., Any] = sums_2d if len(signals) == 2 else sums_3d  # Any: numba's dispatchers
        slope_of: Callable[..., Any] = gradient_2d if len(signals) == 2 else gradient_3d
        parts = self._map(chunks, lambda c: sums(*(s[c] for s in signals), self.modes.weight.shape[0]))
        means = sum(parts[1:], parts[0]) / self.samples
        if self.modes.target is not None:
            means -= self.modes.target
        means[(0,) * means.ndim] = 0.0
        weight = 2.0 / self.samples * self.modes.weight * means
        self._map(chunks, lambda c: slope_of(*(s[c] for s in signals), weight, *(s[c] for s in slopes)))
        return float((self.modes.weight * means * means).sum()), slopes


def _weight(modes: int, dimensions: int) -> NDArray[np.float64]:
    """ε = 1 for the constant mode, 2 for the others, along each axis: what Parseval gives the squared
    means.
    """
    epsilon = np.full(modes, 2.0)
    epsilon[0] = 1.0
    weight = epsilon
    for _ in range(dimensions - 1):
        weight = weight[..., None] * epsilon
    return weight


def _excess_cost(signal: NDArray[np.float64], limit: float, weight: float) -> tuple[float, NDArray[np.float64]]:
    """weight·mean(max(0, abs(u) − limit)²) and its derivative by each sample."""
    over = np.clip(signal, -limit, limit)
    np.subtract(signal, over, out=over)
    charge = float(weight / signal.size * (over * over).sum())
    over *= 2.0 * weight / signal.size
    return charge, over


def _disc_cost(
    x: NDArray[np.float64], y: NDArray[np.float64], weight: float
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """weight·mean(max(0, r − 1)²), r the distance from the centre, and its derivatives by x and by y."""
    radius = np.sqrt(x * x + y * y)
    over = np.maximum(radius - 1.0, 0.0)
    slope = 2.0 * weight / x.size * over / np.maximum(radius, 1.0)
    return float(weight / x.size * (over * over).sum()), slope * x, slope * y


def _chunks(samples: int) -> list[slice]:
    if samples < _MANY:
        return [slice(0, samples)]
    size = -(-samples // _CHUNKS)
    return [slice(start, min(start + size, samples)) for start in range(0, samples, size)]
