"""What a sensitivity study found: the shares of every parameter, by each method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.studies.sensitivity.asked import Sensitivity
from identification.studies.sensitivity.network import Share

Floats = NDArray[np.float64]

GARSON, TOTAL, FIRST, ALONE, LOCAL = (
    "Garson, network", "variance, total", "variance, first order", "one at a time", "local slope",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitive:
    """Sensitivity of the force to K parameters at one operating point.

    `changes` (S,): rms change of the force of each grid sample, N. `first`, `total` (K,): variance-based indices of
    that change over the box of the levels. `alone` (K,): the greatest change when only one parameter moves, N.
    `slopes` (K,): rms of p·∂F/∂p, N.
    """

    model: str
    asked: Sensitivity
    names: tuple[str, ...]
    values: Floats
    changes: Floats
    networks: tuple[Share, ...]
    first: Floats
    total: Floats
    alone: Floats
    slopes: Floats

    @property
    def garson(self) -> Floats:
        """Shares by Garson, (networks, K)."""
        return np.stack([one.shares for one in self.networks])

    def shares(self) -> Mapping[str, Floats]:
        """Share of each parameter by each method, in %, summing to 100, (K,)."""
        given = {
            GARSON: self.garson.mean(axis=0), TOTAL: np.maximum(self.total, 0.0), FIRST: np.maximum(self.first, 0.0),
            ALONE: self.alone, LOCAL: self.slopes,
        }  # fmt: skip
        return {name: 100.0 * part / max(float(part.sum()), 1e-300) for name, part in given.items()}

    def order(self, method: str) -> list[str]:
        """The parameters, the most influential first."""
        return [self.names[k] for k in np.argsort(-self.shares()[method], kind="stable")]

    @property
    def interaction(self) -> float:
        """Share of the variance of the change that no parameter alone explains."""
        return float(1.0 - np.sum(self.first))
