"""A kind of model for the tests: a polynomial in velocity. One file, and one line in the table of kinds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models import Kind, Motion, SimulationModel, TrainingRange

Floats = NDArray[np.float64]
POLYNOMIAL = Kind(name="polynomial", reader="tests.identification.polynomial:polynomial_from_json")


@dataclass(frozen=True, slots=True, kw_only=True)
class Polynomial:
    """F = Σ c_k·v^k, trained up to a speed."""

    name: str
    coefficients: tuple[float, ...]
    trained_m_s: float
    kind: str = "polynomial"

    @property
    def inputs(self) -> Mapping[str, str]:
        return {"displacement": "the polynomial"}

    @property
    def training_range(self) -> TrainingRange | None:
        return TrainingRange({"velocity": (-self.trained_m_s, self.trained_m_s)})

    def names(self) -> Sequence[str]:
        return [f"c{k}" for k in range(len(self.coefficients))]

    def values(self) -> Floats:
        return np.array(self.coefficients)

    def free(self) -> NDArray[np.bool_]:
        return np.ones(len(self.coefficients), dtype=np.bool_)

    def bounds(self) -> tuple[Floats, Floats]:
        return np.full(len(self.coefficients), -np.inf), np.full(len(self.coefficients), np.inf)

    def force(self, motion: Motion) -> Floats:
        return np.polynomial.Polynomial(self.coefficients)(motion.v)


def polynomial_from_json(data: Any) -> SimulationModel:
    """The model of a parsed file; raises ModelError."""
    if "coefficients" not in data:
        raise ModelError("coefficients is missing: give a list of numbers")
    return Polynomial(name=data["name"], coefficients=tuple(data["coefficients"]), trained_m_s=data["trained"])
