"""A network of rectified linear layers trained by Adam, as a yaw-damper study describes it; numpy alone.

Adam (Kingma and Ba 2015) at 0.001, times 0.9 every 100 epochs, weight decay 1e-5 in the gradient, mini-batches of
10 000; single precision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
Layer = tuple[Singles, Singles]  # weights (inputs, outputs) and biases (outputs,)

_RATE, _FACTOR, _EVERY = 1e-3, 0.9, 100
_DECAY = 1e-5
BATCH = 10_000
_CHUNK = 1_000  # rows whose activations stay in the cache
_BETA = (0.9, 0.999)
_SMALL = 1e-8


@dataclass(frozen=True, slots=True)
class Relu:
    """The layers, first to last."""

    layers: tuple[Layer, ...]

    def __call__(self, inputs: Singles) -> Singles:
        """The output (N,) of scaled inputs (N, m)."""
        return np.concatenate([_activations(self.layers, part)[-1][:, 0] for part in _chunks(inputs)])


def begun(inputs: int, nodes: int, hidden: int, seed: int) -> Relu:
    """Random weights (Glorot and Bengio 2010), no biases."""
    rng, widths = np.random.default_rng(seed), [inputs, *[nodes] * hidden, 1]
    layers = []
    for before, after in pairwise(widths):
        reach = np.sqrt(6.0 / (before + after))
        layers.append((rng.uniform(-reach, reach, (before, after)).astype(np.float32), np.zeros(after, np.float32)))
    return Relu(tuple(layers))


def trained(
    network: Relu,
    inputs: Singles,
    wanted: Singles,
    *,
    epochs: int,
    seed: int,
    told: Callable[[int, Relu], None],
    batch: int = BATCH,
) -> Relu:
    """The network after so many epochs of Adam over mini-batches of `batch`; `told` after each hundred."""
    rng = np.random.default_rng(seed)
    weights = [part.copy() for layer in network.layers for part in layer]
    first, second = [np.zeros_like(one) for one in weights], [np.zeros_like(one) for one in weights]
    steps = 0
    for epoch in range(epochs):
        rate = _RATE * _FACTOR ** (epoch // _EVERY)
        for rows in np.array_split(rng.permutation(wanted.size), -(-wanted.size // batch)):
            steps += 1
            slopes = _slopes(_layers(weights), inputs[rows], wanted[rows])
            for w, g, m, v in zip(weights, slopes, first, second, strict=True):
                g += np.float32(_DECAY) * w if w.ndim == 2 else np.float32(0.0)
                m *= _BETA[0]
                m += np.float32(1.0 - _BETA[0]) * g
                v *= _BETA[1]
                v += np.float32(1.0 - _BETA[1]) * g * g
                size = np.sqrt(v / np.float32(1.0 - _BETA[1] ** steps)) + np.float32(_SMALL)
                w -= np.float32(rate / (1.0 - _BETA[0] ** steps)) * m / size
        if (epoch + 1) % _EVERY == 0:
            told(epoch + 1, Relu(_layers(weights)))
    return Relu(_layers(weights))


def _layers(weights: list[Singles]) -> tuple[Layer, ...]:
    return tuple(zip(weights[::2], weights[1::2], strict=True))


def _chunks(rows: Singles) -> list[Singles]:
    return [rows[k : k + _CHUNK] for k in range(0, rows.shape[0], _CHUNK)]


def _activations(layers: tuple[Layer, ...], rows: Singles) -> list[Singles]:
    out = [rows]
    for k, (weights, biases) in enumerate(layers):
        z = out[-1] @ weights + biases
        out.append(np.maximum(z, 0.0, out=z) if k + 1 < len(layers) else z)
    return out


def _slopes(layers: tuple[Layer, ...], inputs: Singles, wanted: Singles) -> list[Singles]:
    """Gradient of ½ of the mean square error by all weights, in their order."""
    sums = [np.zeros_like(part) for layer in layers for part in layer]
    for rows, goal in zip(_chunks(inputs), _chunks(wanted), strict=True):
        seen = _activations(layers, rows)
        back = (seen[-1] - goal[:, None]) / np.float32(wanted.size)
        for k in range(len(layers) - 1, -1, -1):
            sums[2 * k] += seen[k].T @ back
            sums[2 * k + 1] += back.sum(axis=0)
            if k:
                back = (back @ layers[k][0].T) * (seen[k] > 0.0)
    return sums
