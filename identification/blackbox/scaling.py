"""The scale of every signal of a black box: its centre, its size, and the range that it was trained in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.motion import held
from identification.models.simulation import LARGEST_FORCE

Floats = NDArray[np.float64]

# Share of the trained span by which an input may leave it before the network sees its edge. Half: a service run that
# is a little faster is cut. Double: a spike moves the network to where nothing was ever learned, and a force that is
# fed back may settle there.
MARGIN = 0.5

# Of the range, the least size of a signal: that of a single spike in 10¹² samples. What is less is no
# signal but a number by which a division overflows.
_LEAST_SIZE = 1e-6

LARGEST = LARGEST_FORCE  # SI, of any signal: its square is still a number


@dataclass(frozen=True, slots=True)
class Scale:
    """Centre and size of a signal in training, and its lowest and highest value, SI."""

    centre: float
    size: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.centre, self.size, self.low, self.high))):
            raise ModelError(f"scale {self} must be of finite numbers")
        if not self.size > 0.0:
            raise ModelError(f"size is {self.size:g}: it must be above 0")
        if not self.low < self.high:
            raise ModelError(f"range is [{self.low:g}, {self.high:g}]: the lower value comes first")
        if max(-self.low, self.high) > LARGEST:
            raise ModelError(f"range is [{self.low:g}, {self.high:g}]: it must lie within ±{LARGEST:g}, SI")
        span = self.high - self.low
        if not self.low - span <= self.centre <= self.high + span:
            raise ModelError(f"centre is {self.centre:g}: it must lie in the range [{self.low:g}, {self.high:g}]")
        if not _LEAST_SIZE * span <= self.size <= span:
            raise ModelError(f"size is {self.size:g}: it must lie within {_LEAST_SIZE:g} … 1 of the range of {span:g}")

    @property
    def told_apart(self) -> tuple[float, float]:
        """The values, SI, beyond which the network sees the edge of what it tells apart."""
        margin = MARGIN * (self.high - self.low)
        return self.low - margin, self.high + margin

    @property
    def edges(self) -> tuple[float, float]:
        """The same, scaled."""
        low, high = self.told_apart
        return self.scaled(low), self.scaled(high)

    @property
    def trained(self) -> tuple[float, float]:
        """The lowest and the highest scaled value of the training."""
        return self.scaled(self.low), self.scaled(self.high)

    def scaled(self, value: float) -> float:
        """A value as the network sees it."""
        return (value - self.centre) / self.size


Scales = Mapping[str, Scale]


def scale_of(values: Floats) -> Scale:
    """The scale of a signal; raises ModelError where it is constant."""
    size = float(np.std(values))
    if not size > 0.0:
        raise ModelError("it is constant")
    return Scale(float(np.mean(values)), size, float(np.min(values)), float(np.max(values)))


def seen(scale: Scale, values: Floats) -> Floats:
    """A signal as the network sees it, (N,): scaled, held where it is not finite, and cut at the edges.

    What comes before the first finite value is the centre.
    """
    values = held(values, scale.centre)
    return (np.clip(values, *scale.told_apart) - scale.centre) / scale.size
