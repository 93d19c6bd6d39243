"""Activation functions of layered networks, by the names that the literature on NARX networks gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError

Floats = NDArray[np.float64]

_FAR = 40.0  # beyond, exp(-z) is nothing beside 1, and would overflow far outside


@dataclass(frozen=True, slots=True)
class Activation:
    """A function of a sum z, its slope from z and its own value, and its number in the compiled loop."""

    code: int
    value: Callable[[Floats], Floats]
    slope: Callable[[Floats, Floats], Floats]


def _logistic(z: Floats) -> Floats:
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(z, -_FAR, _FAR))))


def _bell(z: Floats) -> Floats:
    return np.asarray(np.exp(-np.minimum(z * z, _FAR)))


ACTIVATIONS: Final[Mapping[str, Activation]] = {
    "logsig": Activation(0, _logistic, lambda z, h: h * (1.0 - h)),
    "purelin": Activation(1, lambda z: z, lambda z, h: np.ones_like(z)),
    "tansig": Activation(2, np.tanh, lambda z, h: 1.0 - h * h),
    "satlins": Activation(3, lambda z: np.clip(z, -1.0, 1.0), lambda z, h: (np.abs(z) < 1.0).astype(np.float64)),
    "radbas": Activation(4, _bell, lambda z, h: -2.0 * z * h),
}
"""logsig 1/(1 + e⁻ᶻ), purelin z, tansig tanh z, satlins z cut at ±1, radbas exp(−z²)."""


def check_activation(name: str) -> None:
    """Raise ModelError where there is no such function."""
    if name not in ACTIVATIONS:
        raise ModelError(f"activation is {name!r}: use {', '.join(ACTIVATIONS)}")
