"""Prediction bands: about what a model simulates, the limits that hold a stated share of what is measured."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from identification.errors import DataError
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel

Floats = NDArray[np.float64]

LEVEL = 0.9
"""The share of the samples that a band holds where none is asked for."""
LOWEST, HIGHEST = 0.5, 0.99  # levels that a model file can hold


@runtime_checkable
class Banded(Protocol):
    """A model that can state a band."""

    def half_width(self, motion: Motion, level: float) -> Floats | None:
        """Half of the width of the band along a motion, (N,), N; None where the model has not been calibrated."""
        ...


def half_width_of(model: SimulationModel, motion: Motion, level: float = LEVEL) -> Floats | None:
    """Half of the width of a model's band, (N,), N; None where the model states none."""
    return model.half_width(motion, level) if isinstance(model, Banded) else None


def covered(measured: Floats, force: Floats, half: Floats) -> float:
    """Share of the measured samples (N,) within force ± half, each (N,), N."""
    return float(np.mean(np.abs(measured - force) <= half))


def check_level(level: float) -> None:
    """Raise DataError where a band of this level cannot be asked for."""
    if not LOWEST <= level <= HIGHEST:
        raise DataError(f"band of {100.0 * level:g} %: it must lie within {100.0 * LOWEST:g} … {100.0 * HIGHEST:g} %")
