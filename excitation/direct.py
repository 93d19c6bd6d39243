"""Phases that cover the working range uniformly, by direct optimisation of the coverage itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage
from excitation.lbfgs import minimise
from excitation.portable_math import cosine_and_sine

if TYPE_CHECKING:
    from excitation.periodic import Multitone

__all__ = ["Axis", "SoftLimit", "optimise_phases"]

_EXCESS_WEIGHT = 30.0  # weight of samples outside the box, relative to the sum of squared modes
_EXCESS_WEIGHT_COUPLED = (
    1000.0  # the same where displacement and velocity share phases, so that spreading one moves the other out
)
_SMALL_ENOUGH = 1e-5  # squared relative deviation: far below the scatter of cells with a hundred samples
_SMALL_ENOUGH_THINNED = 1e-4  # the same for thinned samples; then all samples are used
_CHUNKS = 8  # fixed, so that sums do not depend on how many threads work


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axis:
    """One variable of the working range: a linear function of the phases' cosines, in half boxes.

    u[n] = Σ A_k cos(2π(k n/N + φ_k + offset)), with rms 1/√3: a uniform distribution over ±1 has that rms.
    """

    tones: int  # index of its multitone
    amplitude: NDArray[np.float64]  # (K,)
    offset_turns: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoftLimit:
    """A limited quantity that is not covered: samples beyond ``limit`` half boxes add to the cost."""

    axis: Axis
    limit: float
    weight: float


def optimise_phases(
    tones: Sequence[Multitone],
    axes: Sequence[Axis],
    soft: Sequence[SoftLimit],
    grid: Sequence[int],
    iterations: int | None,
    threads: int | None = None,
) -> tuple[NDArray[np.float64], ...]:
    """Phases in turns, (K,) for each multitone, that spread the samples evenly over the box of the axes.

    Minimises Σ' w c², c the means of Π cos(m_a θ_a) over the samples, θ_a = π(u_a + 1)/2, over the modes
    below ~1.5 cells, plus what lies outside the box. All c vanish for the uniform distribution (Parseval: Σ'
    2^d c² is the squared relative deviation of the density that the coverage index counts in cells). The
    gradient runs back through one DFT for each axis. Returns the phases with the best coverage index seen.
    The result does not depend on the number of ``threads``; None: as many as the machine offers.
    """
    modes = _modes(grid)
    limit = iterations or (500 if _coupled(axes) or modes > 16 else 200)
    phases = np.concatenate([t.phase_turns for t in tones])
    best, used = (np.inf, phases), 0
    for every in _thinning(tones):
        problem = _Problem(tones, axes, soft, modes, every, threads)
        seen = _BestPhases(problem, grid)
        found = minimise(
            problem.value_and_gradient,
            phases,
            iterations=max(1, limit - used if every == 1 else limit // 2),
            first_step=0.02 * float(np.sqrt(phases.size)) if used == 0 else 1e-3 * float(np.sqrt(phases.size)),
            tolerance=1e-4,
            enough=seen.enough if every == 1 else problem.is_small_enough_thinned,
        )
        phases, used = found.x, used + found.iterations
        if every == 1:
            best = min([*seen.found, (problem.index(phases, grid), phases)], key=lambda pair: pair[0])
    return problem.split(best[1])


class _BestPhases:
    """Computes the coverage index every tenth iteration and keeps the phases with the lowest."""

    def __init__(self, problem: _Problem, grid: Sequence[int]) -> None:
        self.problem, self.grid = problem, grid
        self.found: list[tuple[float, NDArray[np.float64]]] = []

    def enough(self, iteration: int, phases: NDArray[np.float64]) -> bool:
        if iteration % 10 == 0:
            index = self.problem.index(phases, self.grid)
            if not self.found or index < self.found[0][0]:
                self.found = [(index, phases)]
        return self.problem.last_value < _SMALL_ENOUGH


def _coupled(axes: Sequence[Axis]) -> bool:
    """Whether two axes (displacement and velocity) share their phases: a harder search."""
    return len({axis.tones for axis in axes}) < len(axes)


def _thinning(tones: Sequence[Multitone]) -> tuple[int, ...]:
    """Steps through the samples, coarse first: every second or fourth sample where no line comes near the thinned
    Nyquist line, since a smooth signal shows its distribution with few samples; then all samples."""
    samples, highest = tones[0].period_samples, max(int(t.lines.max()) for t in tones)
    for every in (4, 2):
        if samples % every == 0 and highest * 2.5 < samples // every and samples // every >= 4096:
            return (every, 1)
    return (1,)


def _modes(grid: Sequence[int]) -> int:
    """Modes along each axis that resolve the cells; multiples of four, as the compiled loops require.

    Beyond 24 the optimisation gets stuck before finer modes pay; in three dimensions the cost grows with the
    cube.
    """
    if len(grid) == 3:
        return 8
    return 16 if max(grid) <= 12 else 20 if max(grid) <= 16 else 24


class _Problem:
    """Value and gradient over the joined phases of all multitones."""

    def __init__(
        self,
        tones: Sequence[Multitone],
        axes: Sequence[Axis],
        soft: Sequence[SoftLimit],
        modes: int,
        every: int,
        threads: int | None = None,
    ) -> None:
        self.samples = tones[0].period_samples // every
        self.lines = [t.lines for t in tones]
        self.axes, self.soft, self.modes = list(axes), list(soft), modes
        self.weight = _weight(modes, len(axes))
        self.last_value, self.threads = np.inf, threads
        self.outside = _EXCESS_WEIGHT_COUPLED if _coupled(axes) else _EXCESS_WEIGHT
        ends = np.cumsum([line.size for line in self.lines])
        self.parts = [slice(int(e) - line.size, int(e)) for e, line in zip(ends, self.lines, strict=True)]

    def split(self, phases: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        return tuple(phases[part] - np.floor(phases[part]) for part in self.parts)

    def is_small_enough_thinned(self, iteration: int, phases: NDArray[np.float64]) -> bool:
        return iteration > 0 and phases.size > 0 and self.last_value < _SMALL_ENOUGH_THINNED

    def index(self, phases: NDArray[np.float64], grid: Sequence[int]) -> float:
        return coverage([self._synthesise(axis, phases)[0] for axis in self.axes], grid).index

    def value_and_gradient(self, phases: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        made = [self._synthesise(axis, phases) for axis in self.axes]
        signals = [signal for signal, _ in made]
        value, slopes = self._uniformity(signals)
        gradient = np.zeros_like(phases)
        for axis, (signal, turned), slope in zip(self.axes, made, slopes, strict=True):
            charge, extra = _excess_cost(signal, 1.0, self.outside)
            value += charge
            self._add_gradient(axis, turned, slope + extra, gradient)
        for quantity in self.soft:
            signal, turned = self._synthesise(quantity.axis, phases)
            charge, extra = _excess_cost(signal, quantity.limit, quantity.weight)
            if charge > 0.0:
                value += charge
                self._add_gradient(quantity.axis, turned, extra, gradient)
        self.last_value = value
        return value, gradient

    def _synthesise(
        self, axis: Axis, phases: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], NDArray[np.float64]]]:
        cos, sin = cosine_and_sine(phases[self.parts[axis.tones]] + axis.offset_turns)
        real, imaginary = axis.amplitude * cos, axis.amplitude * sin
        spectrum = np.zeros(self.samples // 2 + 1, dtype=np.complex128)
        spectrum.real[self.lines[axis.tones]] = real
        spectrum.imag[self.lines[axis.tones]] = imaginary
        return np.fft.irfft(spectrum, n=self.samples, norm="forward") * 0.5, (real, imaginary)

    def _add_gradient(
        self,
        axis: Axis,
        turned: tuple[NDArray[np.float64], NDArray[np.float64]],
        slope: NDArray[np.float64],
        gradient: NDArray[np.float64],
    ) -> None:
        """Adds ∂/∂φ_k = −2π A_k Im(e^{jφ} conj(G_k)), G the DFT of the slopes over the samples."""
        real, imaginary = turned
        g = np.fft.rfft(slope)[self.lines[axis.tones]]
        gradient[self.parts[axis.tones]] -= 2.0 * np.pi * (imaginary * g.real - real * g.imag)

    def _map_chunks(self, chunks: list[slice], work: Callable[[slice], Any]) -> list[Any]:
        """Any: what the compiled function returns. Threads only where there is more than one chunk."""
        if len(chunks) == 1:
            return [work(chunks[0])]
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(work, chunks))

    def _uniformity(self, signals: list[NDArray[np.float64]]) -> tuple[float, list[NDArray[np.float64]]]:
        # imported here because numba takes long to load
        from excitation.modes import gradient_2d, gradient_3d, sums_2d, sums_3d

        chunks = _chunks(self.samples)
        slopes = [np.empty(self.samples) for _ in signals]
        sums: Callable[..., Any] = sums_2d if len(signals) == 2 else sums_3d  # Any: numba's dispatchers
        slope_of: Callable[..., Any] = gradient_2d if len(signals) == 2 else gradient_3d
        parts = self._map_chunks(chunks, lambda c: sums(*(s[c] for s in signals), self.modes))
        means = sum(parts[1:], parts[0]) / self.samples
        means[(0,) * means.ndim] = 0.0
        weight = 2.0 / self.samples * self.weight * means
        self._map_chunks(chunks, lambda c: slope_of(*(s[c] for s in signals), weight, *(s[c] for s in slopes)))
        return float((self.weight * means * means).sum()), slopes


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
    over = np.maximum(signal - limit, 0.0) + np.minimum(signal + limit, 0.0)
    return float(weight / signal.size * (over * over).sum()), 2.0 * weight / signal.size * over


def _chunks(samples: int) -> list[slice]:
    if samples < 2**16:
        return [slice(0, samples)]
    size = -(-samples // _CHUNKS)
    return [slice(start, min(start + size, samples)) for start in range(0, samples, size)]
