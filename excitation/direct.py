"""Phases that fill the box that the samples reach uniformly, by direct optimisation of the coverage itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from excitation.coverage import coverage
from excitation.coverage_cost import Axis, CoverageCost, SoftLimit, plain_modes
from excitation.lbfgs import minimise

if TYPE_CHECKING:
    from excitation.periodic import Multitone

__all__ = ["modes_for", "optimise_phases"]

_EXCESS_WEIGHT = 30.0  # weight of samples outside the box, relative to the sum of squared modes
_EXCESS_WEIGHT_COUPLED = (
    1000.0  # the same where displacement and velocity share phases, so that spreading one moves the other out
)
_SMALL_ENOUGH = 1e-5  # squared relative deviation: far below the scatter of cells with a hundred samples
_SMALL_ENOUGH_THINNED = 1e-4  # the same for thinned samples; then all samples are used


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
    modes = modes_for(grid)
    limit = iterations or (500 if _coupled(axes) or modes > 16 else 200)
    phases = np.concatenate([t.phase_turns for t in tones])
    best, used = (np.inf, phases), 0
    for every in _thinning(tones):
        outside = _EXCESS_WEIGHT_COUPLED if _coupled(axes) else _EXCESS_WEIGHT
        problem = CoverageCost(tones, axes, soft, plain_modes(modes, len(axes)), every, outside, threads)
        seen = _BestPhases(problem, grid)
        found = minimise(
            problem.value_and_gradient,
            phases,
            iterations=max(1, limit - used if every == 1 else limit // 2),
            first_step=0.02 * float(np.sqrt(phases.size)) if used == 0 else 1e-3 * float(np.sqrt(phases.size)),
            tolerance=1e-4,
            enough=seen.enough if every == 1 else seen.enough_thinned,
        )
        phases, used = found.x, used + found.iterations
        if every == 1:
            best = min([*seen.found, (seen.index(phases), phases)], key=lambda pair: pair[0])
    return problem.split(best[1])


class _BestPhases:
    """Computes the coverage index every tenth iteration and keeps the phases with the lowest."""

    def __init__(self, problem: CoverageCost, grid: Sequence[int]) -> None:
        self.problem, self.grid = problem, grid
        self.found: list[tuple[float, NDArray[np.float64]]] = []

    def enough(self, iteration: int, phases: NDArray[np.float64]) -> bool:
        if iteration % 10 == 0:
            index = self.index(phases)
            if not self.found or index < self.found[0][0]:
                self.found = [(index, phases)]
        return self.problem.last_value < _SMALL_ENOUGH

    def enough_thinned(self, iteration: int, phases: NDArray[np.float64]) -> bool:
        return iteration > 0 and phases.size > 0 and self.problem.last_value < _SMALL_ENOUGH_THINNED

    def index(self, phases: NDArray[np.float64]) -> float:
        return coverage(self.problem.signals(phases), self.grid).index


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


def modes_for(grid: Sequence[int]) -> int:
    """Modes along each axis that resolve the cells; multiples of four, as the compiled loops require.

    Beyond 24 the optimisation gets stuck before finer modes pay; in three dimensions the cost grows with the
    cube.
    """
    if len(grid) == 3:
        return 8
    return 16 if max(grid) <= 12 else 20 if max(grid) <= 16 else 24
