"""A network K–H–1 with a hidden layer of tanh nodes: its training, and Garson's shares of its inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.blackbox.levenberg import train
from identification.blackbox.network import Sums

Floats = NDArray[np.float64]

# Steps and weight decay, all scaled: at them the networks fit as well as the published one. They decide Garson's
# shares: with a tenth of the decay and twice the steps the greatest two change places.
_STEPS, _DECAY = 150, 1e-4


@dataclass(frozen=True, slots=True)
class Samples:
    """Scaled inputs (N, K) and outputs (N,), in −1 … 1."""

    inputs: Floats
    outputs: Floats

    @property
    def counted(self) -> NDArray[np.bool_]:
        """All samples count."""
        return np.ones(self.outputs.size, dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class TanhNetwork:
    """y = v·tanh(W x + b) + v₀. Weights: W (H, K), b (H,), v (H,), v₀ one after the other."""

    count: int  # K
    hidden: int  # H

    @property
    def size(self) -> int:
        """Number of weights."""
        return self.hidden * (self.count + 2) + 1

    def parts(self, weights: Floats) -> tuple[Floats, Floats, Floats, float]:
        """W, b, v and v₀."""
        h, k = self.hidden, self.count
        inner, bias, outer = np.split(weights[:-1], [h * k, h * k + h])
        return inner.reshape(h, k), bias, outer, float(weights[-1])

    def first(self, random: np.random.Generator) -> Floats:
        """Weights to begin with: those of Nguyen & Widrow (1990) spread the nodes over the inputs."""
        inner = random.uniform(-1.0, 1.0, (self.hidden, self.count))
        size = 0.7 * self.hidden ** (1.0 / self.count)
        inner *= size / np.linalg.norm(inner, axis=1, keepdims=True)
        bias = size * np.linspace(-1.0, 1.0, self.hidden)
        return np.concatenate([inner.ravel(), bias, random.uniform(-0.5, 0.5, self.hidden), [0.0]])

    def simulate(self, weights: Floats, samples: Samples, horizon: int | None = None) -> Floats:
        """Output of every sample, (N,)."""
        inner, bias, outer, end = self.parts(weights)
        return np.asarray(np.tanh(samples.inputs @ inner.T + bias) @ outer + end)

    def squares(self, weights: Floats, samples: Samples, horizon: int | None = None) -> float:
        """Σe²."""
        return float(np.sum((samples.outputs - self.simulate(weights, samples)) ** 2))

    def sums(self, weights: Floats, samples: Samples, force: Floats, horizon: int | None = None) -> Sums:
        """Σe², JᵀJ and Jᵀe of the outputs `force`."""
        inner, bias, outer, _ = self.parts(weights)
        nodes = np.tanh(samples.inputs @ inner.T + bias)
        slope = (1.0 - nodes**2) * outer
        by_inner = (slope[:, :, None] * samples.inputs[:, None, :]).reshape(len(nodes), -1)
        jacobian = np.column_stack([by_inner, slope, nodes, np.ones(len(nodes))])
        error = samples.outputs - force
        return Sums(float(error @ error), jacobian.T @ jacobian, jacobian.T @ error)


@dataclass(frozen=True, slots=True)
class Share:
    """Garson's shares of the inputs, (K,), summing to 1, and the share of unseen samples within 5 % of the output."""

    shares: Floats
    within: float


def trained_share(samples: Samples, unseen: Samples, outputs: tuple[float, float], hidden: int, seed: int) -> Share:
    """A network trained with some samples and checked with others; `outputs`: lowest and highest before scaling."""
    network = TanhNetwork(samples.inputs.shape[1], hidden)
    start = network.first(np.random.default_rng(seed))
    found = train(network, start, samples, decay=_DECAY, most_steps=_STEPS, tolerance=1e-5)
    inner, _, outer, _ = network.parts(found.weights)
    low, high = outputs
    real = 0.5 * (unseen.outputs + 1.0) * (high - low) + low
    apart = 0.5 * (high - low) * np.abs(unseen.outputs - network.simulate(found.weights, unseen))
    return Share(garson(inner, outer), float(np.mean(apart <= 0.05 * np.abs(real))))


def garson(inner: Floats, outer: Floats) -> Floats:
    """Garson's share of each input: Σ_j |w_ji v_j|/Σ_i |w_ji|, over their sum, (K,).

    inner : (H, K), weights from the inputs; outer : (H,), to the output

    References
    ----------
    Garson, Interpreting neural-network connection weights, AI Expert, 1991.
    """
    part = np.abs(inner) * np.abs(outer)[:, None] / np.sum(np.abs(inner), axis=1, keepdims=True)
    return np.asarray(part.sum(axis=0) / part.sum())
