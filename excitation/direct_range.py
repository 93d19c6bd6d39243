"""Phases that fill a given range of working points evenly, after the rig and within the limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from excitation.coverage_cost import Axis, CoverageCost, Modes, SoftLimit, plain_modes
from excitation.direct import modes_for
from excitation.lbfgs import Minimum, minimise
from excitation.portable_math import cosine_and_sine

if TYPE_CHECKING:
    from excitation.periodic import Multitone

__all__ = ["LIMIT_WEIGHT", "optimise_within"]

Phases = tuple[NDArray[np.float64], ...]

# Weights of mean squared excess, in half boxes, against the sum of squared modes. The excess decides how much smaller
# the whole motion gets when it is scaled into its limits: 1 % costs 0.04 % of D, on each axis. At a tenth limits are
# exceeded by 2 to 5 %; at ten times the search ends earlier, with 0.1 % more D.
LIMIT_WEIGHT = 1000.0  # of limited quantities that are not covered
_OUTSIDE_WEIGHT = 100.0  # of samples outside the range
_OUTSIDE_WEIGHT_DISC = 300.0  # of samples outside an ellipse, whose two axes share their phases

_FIRST_MODES = 8
_COARSE = 400  # points along each axis at which the ellipse's modes are summed: they are exact to 1e-4
_SMALL_ENOUGH = 1e-5  # squared relative deviation: far below the scatter of cells with a hundred samples
_SMALL_THINNED = 3e-4  # the same of thinned samples of a long period
_MANY, _EVEN_ENOUGH = 2**16, 0.35  # samples from which a search ends at this coverage index, percent, to save time
_EDGE_THINNED = 0.97  # half boxes: samples left out reach 1 to 3 % further, and all samples take longest to bring in
_MODES_THINNED = 12  # of a long period
_FEWEST_THINNED = 4096  # samples


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """Modes along each axis, step through the samples, most iterations."""

    modes: int
    every: int
    iterations: int


def optimise_within(
    tones: Sequence[Multitone],
    axes: Sequence[Axis],
    soft: Sequence[SoftLimit],
    disc: tuple[int, int] | None,
    grid: Sequence[int],
    index: Callable[[Phases], float],
    iterations: int | None = None,
) -> tuple[Phases, float]:
    """Phases in turns, (K,) for each multitone, and their coverage index of the range.

    As ``optimise_phases`` for the range that the axes state, an ellipse for those of ``disc``. The modes are weighted
    as cells see them, by sinc²(m/(2·cells)) on each axis, and are few at first. ``index`` is the coverage index
    within the limits; the phases with the lowest one seen are returned.
    """
    phases = np.concatenate([t.phase_turns for t in tones])
    lowest, best = np.inf, phases
    found: Minimum | None = None
    many = tones[0].period_samples >= _MANY
    for stage in _stages(tones, grid, iterations):
        outside = _OUTSIDE_WEIGHT if disc is None else _OUTSIDE_WEIGHT_DISC
        thinned = many and stage.every > 1
        seen = [replace(one, every=_step_of(one, tones, stage.every)) for one in soft] if many else soft
        modes, edge = _modes(stage.modes, grid, disc), _EDGE_THINNED if thinned else 1.0
        cost = CoverageCost(tones, axes, seen, modes, stage.every, outside, edge=edge)

        def enough(iteration: int, x: NDArray[np.float64], cost: CoverageCost = cost, every: int = stage.every) -> bool:
            nonlocal lowest, best
            if every == 1 and iteration % (5 if many else 10) == 0 and (now := index(cost.split(x))) < lowest:
                lowest, best = now, x
            if many and every > 1:
                return cost.last_value < _SMALL_THINNED
            return cost.last_value < _SMALL_ENOUGH or (many and lowest < _EVEN_ENOUGH)

        step = 0.02 if found is None else 1e-3
        found = minimise(
            cost.value_and_gradient,
            phases,
            iterations=stage.iterations,
            first_step=step * float(np.sqrt(phases.size)),
            tolerance=1e-4,
            enough=enough,
            pairs=found.pairs if found is not None and many else (),
        )
        phases = found.x
    reached = index(cost.split(phases))
    return (cost.split(phases), reached) if reached < lowest else (cost.split(best), lowest)


def _stages(tones: Sequence[Multitone], grid: Sequence[int], iterations: int | None) -> tuple[Stage, ...]:
    """Few modes first, on thinned samples where that shows the same distribution; then all that cells resolve."""
    three = len(grid) == 3
    limit = iterations or (400 if three else 360)
    every, fine = _thinning(tones), 12 if three else modes_for(grid)
    start = limit * 3 // 8 if three else limit // (6 if tones[0].period_samples < _MANY else 12)
    coarse = Stage(modes=_FIRST_MODES, every=every, iterations=max(1, start))
    left = max(1, limit - start)
    if every == 1:
        return coarse, Stage(modes=fine, every=1, iterations=left)
    thinned = min(fine, _MODES_THINNED) if tones[0].period_samples >= _MANY else fine
    return coarse, Stage(modes=thinned, every=every, iterations=left), Stage(modes=fine, every=1, iterations=left)


def _thinning(tones: Sequence[Multitone]) -> int:
    """Largest step through the samples, a power of two, at which no line passes the Nyquist line."""
    samples, highest, every = tones[0].period_samples, max(int(t.lines.max()) for t in tones), 1
    while samples % (2 * every) == 0 and samples // (2 * every) >= max(_FEWEST_THINNED, 2.1 * highest):
        every *= 2
    return every


def _step_of(limit: SoftLimit, tones: Sequence[Multitone], every: int) -> int:
    """Largest step through samples thinned by ``every`` that leaves four to a period of the limit's highest line."""
    motion, step = tones[limit.axis.tones], 1
    samples, highest = motion.period_samples // every, int(motion.lines.max())
    while samples % (2 * step) == 0 and samples // (2 * step) >= 4 * highest:
        step *= 2
    return step


def _modes(count: int, grid: Sequence[int], disc: tuple[int, int] | None) -> Modes:
    plain = plain_modes(count, len(grid))
    weight = plain.weight
    for axis, cells in enumerate(grid):
        seen = _sinc(np.arange(float(count)) / (2.0 * cells)) ** 2
        weight = weight * seen.reshape([-1 if place == axis else 1 for place in range(len(grid))])
    return Modes(weight=weight, target=None if disc is None else _disc_modes(count, len(grid), disc), disc=disc)


def _disc_modes(count: int, dimensions: int, disc: tuple[int, int]) -> NDArray[np.float64]:
    """Means of cos(pθ)cos(qθ') over the unit disc, θ = π(u + 1)/2, on the plane of its axes; zero elsewhere."""
    place = (2.0 * np.arange(_COARSE) + 1.0) / _COARSE - 1.0
    half = np.sqrt(1.0 - place * place)
    # cos(qθ') over the chord −half … half: closed form; over the disc: a sum of chords
    mode = np.arange(float(count))[:, None]
    along = cosine_and_sine(0.25 * mode * (place + 1.0))[0]
    chord = 2.0 * half * _sinc(0.5 * mode * half) * cosine_and_sine(0.25 * mode)[0]
    means = (along[:, None, :] * chord[None, :, :]).sum(axis=2) / (2.0 * half).sum()
    if dimensions == 2:
        return np.asarray(means)
    target = np.zeros((count,) * 3)
    third = next(axis for axis in range(3) if axis not in disc)
    target[tuple(0 if axis == third else slice(None) for axis in range(3))] = means
    return target


def _sinc(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """sin(πx)/(πx), with the same bits on every processor."""
    angle = np.pi * np.where(x == 0.0, 1.0, x)
    return np.where(x == 0.0, 1.0, cosine_and_sine(0.5 * x)[1] / angle)
