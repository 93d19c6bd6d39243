"""What every kind of model can do: a physical model, an FMU, a black box."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.motion import Motion
from identification.models.visited import Visited
from identification.signals import SIGNALS, UNITS
from rigctl.runfile import Run

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrainingRange:
    """Lowest and highest value of each signal in the training of a model, SI, temperature in °C.

    `together` says where some of them went together; None: nothing states it.
    """

    limits: Mapping[str, tuple[float, float]]
    together: Visited | None = None

    def __post_init__(self) -> None:
        for signal, (low, high) in self.limits.items():
            if signal not in SIGNALS:
                raise ModelError(f"training range of {signal!r}: the signals are {', '.join(SIGNALS)}")
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ModelError(
                    f"training range of {signal} is [{low:g}, {high:g}]: it must be two finite numbers, the lower first"
                )

    def left(self, motion: Motion) -> Mapping[str, float]:
        """Share of the samples of a motion that lie outside, by signal; only signals that leave their range."""
        shares = {}
        for signal, (low, high) in self.limits.items():
            series = getattr(motion, SIGNALS[signal])
            share = float(np.mean((series < low) | (series > high)))
            if share > 0.0:
                shares[signal] = share
        return shares

    def inside(self, motion: Motion) -> Motion:
        """The motion with every signal cut at the edges of its range."""
        cut = {
            SIGNALS[signal]: np.clip(getattr(motion, SIGNALS[signal]), low, high)
            for signal, (low, high) in self.limits.items()
        }
        return replace(motion, **cut)

    def described(self, motion: Motion) -> list[str]:
        """A sentence for each signal of a motion that leaves its range, and one where their combination is new.

        They say how often, where first, and how far.
        """
        sentences = []
        for signal in self.left(motion):
            series = getattr(motion, SIGNALS[signal])
            sentences += leaving(signal, UNITS[signal], series, self.limits[signal], motion.dt)
        return sentences if self.together is None else [*sentences, *self.together.described(motion)]


def leaving(signal: str, unit: str, series: Floats, limits: tuple[float, float], dt: float) -> list[str]:
    """A sentence where a signal (N,) leaves its training range: how often, where first, and how far; or none."""
    low, high = limits
    beyond = np.nan_to_num(np.maximum(low - series, series - high), nan=0.0)  # what is no number is held
    left = beyond > 0.0
    if not left.any():
        return []
    first, far = int(np.argmax(left)), int(np.argmax(beyond))
    return [
        f"{signal} leaves the training range [{low:.4g}, {high:.4g}] {unit} in {100.0 * np.mean(left):.3g} % of the "
        f"samples, first at {first * dt:.4g} s, farthest at {far * dt:.4g} s with {series[far]:.4g} {unit}, "
        f"{beyond[far]:.2g} {unit} beyond"
    ]


class SimulationModel(Protocol):
    """A model of any kind: read from a file, simulated along a motion, compared with others."""

    @property
    def name(self) -> str:
        """The name of the model."""
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
        """Names of the parameter vector, P of them; none where the model states no parameters."""
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


@runtime_checkable
class OfRuns(Protocol):
    """A model that needs more of a run than its motion along one axis: it is taken along one run at a time."""

    def bound_to(self, run: Run) -> SimulationModel:
        """The model along this run."""
        ...
