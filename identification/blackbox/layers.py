"""A feed-forward network of one to three hidden layers: its prediction from regressors, and the gradient of that.

h⁰ = φ, hᵏ = f(Wᵏ·hᵏ⁻¹ + bᵏ), y = m + r·g(wᵀ·hᴸ + b): f the activation of the hidden layers, g that of the output, m and
r the middle and half of the trained span of the scaled force, so that an output within ±1 covers it.
The vector of weights holds Wᵏ (out, in) row by row, then bᵏ, layer by layer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.activations import ACTIVATIONS, check_activation
from identification.blackbox.network import Sums
from identification.blackbox.polynomial import regressors_of
from identification.blackbox.samples import Samples
from identification.blackbox.scaling import Scale
from identification.blackbox.structure import MOST_NODES
from identification.errors import ModelError

Floats = NDArray[np.float64]

MOST_LAYERS = 3
_BLOCK = 2048  # rows of the gradient at once


@dataclass(frozen=True, slots=True)
class Layers:
    """Nodes of each hidden layer, and the activation functions of these layers and of the output."""

    nodes: tuple[int, ...]
    hidden: str = "tansig"
    output: str = "purelin"

    def __post_init__(self) -> None:
        if not 1 <= len(self.nodes) <= MOST_LAYERS:
            raise ModelError(f"{len(self.nodes)} hidden layers: there must be 1 … {MOST_LAYERS}")
        for count in self.nodes:
            if not 1 <= count <= MOST_NODES:
                raise ModelError(f"a layer of {count} nodes: it must have 1 … {MOST_NODES}")
        check_activation(self.hidden)
        check_activation(self.output)

    def __str__(self) -> str:
        return f"layers of {', '.join(map(str, self.nodes))} nodes, {self.hidden} and {self.output}"

    def shapes(self, width: int) -> list[tuple[int, int]]:
        """Rows and columns of the weights of every layer, the output last, for `width` regressors."""
        sizes = [width, *self.nodes, 1]
        return [(sizes[k + 1], sizes[k]) for k in range(len(sizes) - 1)]

    def size(self, width: int) -> int:
        """Number of weights for `width` regressors."""
        return sum(rows * (columns + 1) for rows, columns in self.shapes(width))

    def parts(self, weights: Floats, width: int) -> list[tuple[Floats, Floats]]:
        """Matrix and bias of every layer, views of the weights."""
        out, at = [], 0
        for rows, columns in self.shapes(width):
            matrix = weights[at : at + rows * columns].reshape(rows, columns)
            at += rows * columns
            out.append((matrix, weights[at : at + rows]))
            at += rows
        return out


def first_layer_weights(layers: Layers, width: int, seed: int) -> Floats:
    """Random weights: sums of about 1 in every node of scaled signals, and an output near the middle."""
    rng, parts = np.random.default_rng(seed), []
    shapes = layers.shapes(width)
    for k, (rows, columns) in enumerate(shapes):
        share = 0.1 if k == len(shapes) - 1 else 1.0
        parts += [share * rng.standard_normal(rows * columns) / np.sqrt(columns), share * rng.standard_normal(rows)]
    return np.concatenate(parts)


@dataclass(frozen=True, slots=True)
class Rows:
    """Regressors (N, R) with measured past forces, and the force (N,), all scaled; every one counts."""

    phi: Floats
    force: Floats

    @property
    def counted(self) -> NDArray[np.bool_]:
        """All, (N,)."""
        return np.ones(self.force.size, dtype=np.bool_)


def rows_of(samples: Samples, delays: Sequence[int]) -> Rows:
    """The samples that count as rows: what a predictor learns from."""
    return Rows(regressors_of(samples, delays), samples.force[samples.counted])


@dataclass(frozen=True, slots=True)
class Predictor:
    """A layered network that predicts one sample from measured ones, as `levenberg.train` takes it."""

    layers: Layers
    width: int
    span: tuple[float, float]  # middle and half of the trained span of the scaled force

    def simulate(self, weights: Floats, samples: Rows, horizon: int | None = None) -> Floats:
        """The predicted force, (N,), scaled."""
        values, _ = self._forward(weights, samples.phi)
        return np.asarray(self.span[0] + self.span[1] * values[-1][:, 0])

    def squares(self, weights: Floats, samples: Rows, horizon: int | None = None) -> float:
        """Σe²."""
        error = samples.force - self.simulate(weights, samples)
        return float(error @ error)

    def sums(self, weights: Floats, samples: Rows, force: Floats, horizon: int | None = None) -> Sums:
        """Σe², JᵀJ and Jᵀe about a predicted `force`."""
        gram, slope = np.zeros((weights.size, weights.size)), np.zeros(weights.size)
        error = samples.force - force
        for first in range(0, force.size, _BLOCK):
            part = slice(first, first + _BLOCK)
            gradient = self.gradient(weights, samples.phi[part])
            gram += gradient.T @ gradient
            slope += gradient.T @ error[part]
        return Sums(float(error @ error), gram, slope)

    def gradient(self, weights: Floats, phi: Floats) -> Floats:
        """∂y/∂w of every row, (N, P), by backpropagation."""
        values, sums = self._forward(weights, phi)
        parts, out = self.layers.parts(weights, self.width), []
        back = self.span[1] * ACTIVATIONS[self.layers.output].slope(sums[-1], values[-1])
        for k in reversed(range(len(parts))):
            before = phi if k == 0 else values[k - 1]
            matrix = np.einsum("ni,nj->nij", back, before).reshape(phi.shape[0], -1)
            out.append(np.concatenate([matrix, back], axis=1))
            if k:
                slope = ACTIVATIONS[self.layers.hidden].slope(sums[k - 1], values[k - 1])
                back = (back @ parts[k][0]) * slope
        return np.concatenate(out[::-1], axis=1)

    def _forward(self, weights: Floats, phi: Floats) -> tuple[list[Floats], list[Floats]]:
        """Values and sums of every layer, each (N, nodes)."""
        parts, values, sums, before = self.layers.parts(weights, self.width), list[Floats](), list[Floats](), phi
        for k, (matrix, bias) in enumerate(parts):
            name = self.layers.output if k == len(parts) - 1 else self.layers.hidden
            sums.append(before @ matrix.T + bias)
            values.append(ACTIVATIONS[name].value(sums[-1]))
            before = values[-1]
        return values, sums


def span_of(force: Scale) -> tuple[float, float]:
    """Middle and half of the trained span of the scaled force."""
    low, high = force.scaled(force.low), force.scaled(force.high)
    return 0.5 * (low + high), 0.5 * (high - low)
