"""Least squares with weight decay for networks, by Levenberg and Marquardt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from identification.blackbox.network import Sums

Floats = NDArray[np.float64]


class Counted(Protocol):
    """Samples, of which some count."""

    @property
    def counted(self) -> NDArray[np.bool_]: ...


S = TypeVar("S", bound=Counted, contravariant=True)
C = TypeVar("C", bound=Counted)


class Trainable(Protocol[S]):
    """A network that gives a scaled force of weights along samples, Σe², JᵀJ and Jᵀe."""

    def simulate(self, weights: Floats, samples: S, horizon: int | None = None) -> Floats: ...
    def squares(self, weights: Floats, samples: S, horizon: int | None = None) -> float: ...
    def sums(self, weights: Floats, samples: S, force: Floats, horizon: int | None = None) -> Sums: ...


_FIRST_DAMPING = 1e-3  # of the mean of the diagonal of JᵀJ
_LEAST_DAMPING, _MOST_DAMPING = 1e-12, 1e8
_TRIES = 8
_QUIET = 3  # steps in a row that gain less than the tolerance


@dataclass(frozen=True, slots=True)
class Trained:
    """Weights, the mean square of the scaled error, and how many steps were taken."""

    weights: Floats
    error: float
    steps: int


def train(
    network: Trainable[C],
    weights: Floats,
    samples: C,
    *,
    decay: float,
    horizon: int | None = None,
    most_steps: int = 60,
    tolerance: float = 1e-4,
) -> Trained:
    """Minimise (Σe² + decay·θᵀθ)/N over the weights θ, N the samples that count, all scaled.

    The gradient goes through the feedback. The damping follows the ratio of the actual to the predicted decrease
    (Nielsen 1999). Ends where three steps in a row gain less than `tolerance` of the cost.
    """
    count = int(samples.counted.sum())
    sums = network.sums(weights, samples, network.simulate(weights, samples, horizon), horizon)
    squares, cost = sums.squares, sums.squares + decay * float(weights @ weights)
    damping, more, quiet, steps = _FIRST_DAMPING * float(np.mean(np.diag(sums.gram))), 2.0, 0, 0
    while steps < most_steps and quiet < _QUIET:
        if steps:
            sums = network.sums(weights, samples, network.simulate(weights, samples, horizon), horizon)
        steps += 1
        for _ in range(_TRIES):
            step = _step(sums, weights, decay, damping)
            trial = weights + step
            tried = network.squares(trial, samples, horizon)
            new = tried + decay * float(trial @ trial)
            if new < cost:
                break
            damping, more = min(damping * more, _MOST_DAMPING * count), more * 2.0
        else:
            break
        promised = float(step @ (damping * step + sums.slope - decay * weights))
        ratio = (cost - new) / promised if promised > 0.0 else 0.0
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), _LEAST_DAMPING * count)
        more = 2.0
        quiet = quiet + 1 if cost - new < tolerance * cost else 0
        weights, squares, cost = trial, tried, new
    return Trained(weights, squares / count, steps)


def _step(sums: Sums, weights: Floats, decay: float, damping: float) -> Floats:
    """The damped step; damping alone, were rounding to make the matrix indefinite."""
    matrix = sums.gram.copy()
    matrix.ravel()[:: weights.size + 1] += decay + damping
    slope = sums.slope - decay * weights
    _, step, failed = dposv(matrix.T, slope, lower=1, overwrite_a=1)  # symmetric: its transpose lies as LAPACK wants it
    return slope / (decay + damping + float(np.trace(sums.gram))) if failed else np.asarray(step)
