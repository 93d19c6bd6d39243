"""What every kind of model can do: a physical one, somebody else's FMU, a black box."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.motion import Motion

Floats = NDArray[np.float64]

SIGNALS: Mapping[str, str] = {
    "displacement": "x",
    "velocity": "v",
    "acceleration": "a",
    "current": "i",
    "temperature": "temperature",
}
"""What a motion holds: the channel's name, and that of the series in `Motion`."""


@dataclass(frozen=True, slots=True)
class TrainingRange:
    """Lowest and highest value of each signal that a model has seen in training, SI, temperature in °C."""

    limits: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        for signal, (low, high) in self.limits.items():
            if signal not in SIGNALS:
                raise ModelError(f"training range of {signal!r}: the signals are {', '.join(SIGNALS)}")
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ModelError(f"training range of {signal} is [{low:g}, {high:g}]: two finite numbers that rise")

    def left(self, motion: Motion) -> Mapping[str, float]:
        """Share of the samples of a motion that lie outside, by signal; only signals that leave their range."""
        shares = {}
        for signal, (low, high) in self.limits.items():
            series = getattr(motion, SIGNALS[signal])
            share = float(np.mean((series < low) | (series > high)))
            if share > 0.0:
                shares[signal] = share
        return shares


class SimulationModel(Protocol):
    """A model of any kind: what is read from a file, driven by a motion, and compared with the others."""

    @property
    def name(self) -> str:
        """What a person calls it."""
        ...

    @property
    def kind(self) -> str:
        """The word in its file: `physical`, `fmu`, …"""
        ...

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive it, and what in the model needs each."""
        ...

    @property
    def training_range(self) -> TrainingRange | None:
        """Where it was trained; None where nothing states it."""
        ...

    def names(self) -> Sequence[str]:
        """Names of the parameter vector, P of them; none where the model has no parameters that can be told."""
        ...

    def values(self) -> Floats:
        """The parameter vector, (P,), SI."""
        ...

    def free(self) -> NDArray[np.bool_]:
        """Which parameters a fit may move, (P,)."""
        ...

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest value of each parameter, two arrays (P,)."""
        ...

    def force(self, motion: Motion) -> Floats:
        """Force along a motion from its inputs alone, (N,), N; raises SimulationError."""
        ...
