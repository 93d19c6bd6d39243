"""What a sensitivity study is asked to do: the operating point, the levels of the parameters, the network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from excitation.configuration import STRICT
from identification.errors import DataError, ModelError
from identification.models.motion import Motion
from identification.physical.model import Model

_MOST_SAMPLES = 100_000
_SETTLING = 2  # periods before the one that counts
_POINTS = 200  # of a period: the figures change by less than 1e-3 at half


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """A sine of `amplitude_m` at `frequency_hz` and a held current, and relative `levels` of every varied parameter.

    The defaults are those of a study of an MR seat damper (2021): 10 mm, 4 Hz, 0.8 A, five levels, ten hidden nodes,
    15 000 samples to train and the others to check. `networks` are trained from different starts, to see the spread.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    amplitude_m: float = 0.01
    frequency_hz: float = 4.0
    current_a: float = 0.8
    vary: tuple[str, ...] = ()  # empty: all free parameters
    levels: tuple[float, ...] = (0.5, 0.7, 1.0, 1.3, 1.5)  # of the value in the model
    hidden: int = 10
    trained: float = 0.96  # share of the samples to train with: 15 000 of 15 625
    networks: int = 5
    base_samples: int = 2048  # of the variance-based indices, which take (K + 2) times as many
    seed: int = 1

    def __post_init__(self) -> None:
        for name in ("amplitude_m", "frequency_hz"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise DataError(f"{name} is {getattr(self, name):g}: it must be above 0")
        if len(self.levels) < 2 or len(set(self.levels)) < len(self.levels) or not all(v > 0.0 for v in self.levels):
            raise DataError(f"levels are {self.levels}: give two or more different factors above 0")
        if not (1 <= self.hidden <= 100 and 1 <= self.networks <= 50 and 0.5 <= self.trained < 1.0):
            raise DataError(
                f"hidden {self.hidden}, networks {self.networks}, trained {self.trained:g}: they must lie within "
                "1 … 100, 1 … 50 and 0.5 … 1"
            )
        if self.base_samples < 16 or self.base_samples & (self.base_samples - 1):
            raise DataError(f"base_samples is {self.base_samples}: a power of 2 from 16 on, such as 2048")

    def motion(self) -> Motion:
        """Periods of the sine; the last is settled."""
        n = _POINTS * (_SETTLING + 1)
        omega = 2.0 * np.pi * self.frequency_hz
        t = np.arange(n, dtype=np.float64) / (_POINTS * self.frequency_hz)
        x = self.amplitude_m * np.sin(omega * t)
        return Motion(
            dt=1.0 / (_POINTS * self.frequency_hz), x=x, v=self.amplitude_m * omega * np.cos(omega * t),
            a=-(omega**2) * x, i=np.full(n, self.current_a), temperature=np.full(n, 25.0), t=t, period=_POINTS,
            settle=_SETTLING,
        )  # fmt: skip


def places_of(model: Model, asked: Sensitivity) -> list[int]:
    """Places in the parameter vector of what varies.

    Raises
    ------
    ModelError
        Where nothing varies, a name is not one of the model's, a value is 0, a level leaves the bounds, or the grid
        of levels is too large.
    """
    names, values = model.names(), model.values()
    chosen = asked.vary or tuple(n for n, free, v in zip(names, model.free(), values, strict=True) if free and v)
    if len(chosen) < 2:
        raise ModelError(f"{len(chosen)} parameters vary: shares compare two or more of {', '.join(names)}")
    if len(set(chosen)) < len(chosen):
        raise ModelError(f"vary names {max(chosen, key=chosen.count)} twice: once is enough")
    if len(asked.levels) ** len(chosen) > _MOST_SAMPLES:
        raise ModelError(
            f"{len(asked.levels)} levels of {len(chosen)} parameters are {len(asked.levels) ** len(chosen)} samples, "
            f"more than {_MOST_SAMPLES}: vary fewer, or give fewer levels"
        )
    low, high = model.bounds()
    for name in chosen:
        if name not in names:
            raise ModelError(f"vary: '{model.name}' has no parameter '{name}': it has {', '.join(names)}")
        k = names.index(name)
        if values[k] == 0.0:
            raise ModelError(f"{name} is 0 in the model: relative levels need another value")
        ends = [level * values[k] for level in (min(asked.levels), max(asked.levels))]
        if not low[k] <= min(ends) <= max(ends) <= high[k]:
            raise ModelError(f"{name}: levels from {ends[0]:g} to {ends[1]:g} leave its bounds")
    return [names.index(name) for name in chosen]
