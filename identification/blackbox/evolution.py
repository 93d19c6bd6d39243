"""Differential evolution of a layered network: activation functions, weights and biases together, before training."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, OptimizeResult, differential_evolution

from identification.blackbox.activations import ACTIVATIONS
from identification.blackbox.layers import Layers, Predictor, Rows

Floats = NDArray[np.float64]

# After Lin et al. 2020: population, iterations, mutation weight and crossover probability. The mutation weight of an
# iteration is η + (1 − η)·rand, their robust factor.
POPULATION, ITERATIONS, MUTATION, CROSSOVER = 40, 100, 0.6, 0.85

# Of the first population, and the bounds of all that follow: sums of a few units in the nodes of scaled signals. Half:
# saturation is never tried; double: most of the first population is saturated.
_LARGEST = 1.0
_ROWS = 2000  # that the fitness sees, equidistant: double takes twice as long and ranks the same


@dataclass(frozen=True, slots=True)
class Evolved:
    """The fittest network, and the fitness (rms error of the prediction, scaled) along the iterations.

    `best` and `worst` (G + 1,) are those of each population, the first one before any iteration; `hidden` and `output`
    name the activations of the best one.
    """

    layers: Layers
    weights: Floats
    best: Floats
    worst: Floats
    hidden: tuple[str, ...]
    output: tuple[str, ...]

    @property
    def gain(self) -> float:
        """Share by which the best fitness fell."""
        return 1.0 - float(self.best[-1] / self.best[0])


_NAMES: Final = tuple(ACTIVATIONS)


def evolve(
    layers: Layers, span: tuple[float, float], rows: Rows, *, seed: int, iterations: int = ITERATIONS
) -> Evolved:
    """The fittest of a population after differential evolution (Storn and Price 1997) on the error of the prediction.

    An individual is two numbers that choose the activations of the hidden layers and of the output, then all weights
    and biases; those of `layers` are not used.
    """
    width = rows.phi.shape[1]
    step = max(1, rows.force.size // _ROWS)
    seen = Rows(np.ascontiguousarray(rows.phi[::step]), rows.force[::step])
    size = layers.size(width)
    low = np.concatenate([np.zeros(2), np.full(size, -_LARGEST)])
    high = np.concatenate([np.full(2, float(len(_NAMES))), np.full(size, _LARGEST)])
    rng = np.random.default_rng(seed)
    first = low + rng.random((POPULATION, low.size)) * (high - low)

    def fitness(one: Floats) -> float:
        predictor = Predictor(decoded(layers, one), width, span)
        return float(np.sqrt(predictor.squares(one[2:], seen) / seen.force.size))

    begun = np.array([fitness(one) for one in first])
    best, worst = [float(begun.min())], [float(begun.max())]
    names = [decoded(layers, first[int(np.argmin(begun))])]

    def note(intermediate_result: OptimizeResult) -> None:
        best.append(float(np.min(intermediate_result.population_energies)))
        worst.append(float(np.max(intermediate_result.population_energies)))
        names.append(decoded(layers, intermediate_result.x))

    found = differential_evolution(
        fitness, Bounds(low, high), strategy="rand1bin", maxiter=iterations, init=first, tol=0.0,
        mutation=(MUTATION, 1.0), recombination=CROSSOVER, rng=rng, callback=note, polish=False, updating="deferred",
    )  # fmt: skip
    return Evolved(
        layers=decoded(layers, found.x),
        weights=np.asarray(found.x[2:], dtype=np.float64),
        best=np.array(best),
        worst=np.array(worst),
        hidden=tuple(one.hidden for one in names),
        output=tuple(one.output for one in names),
    )


def decoded(layers: Layers, one: Floats) -> Layers:
    """The layers with the activations that the first two numbers of an individual choose."""
    chosen = [_NAMES[min(int(number), len(_NAMES) - 1)] for number in one[:2]]
    return replace(layers, hidden=chosen[0], output=chosen[1])
