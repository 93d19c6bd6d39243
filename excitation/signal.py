"""The samples that a rig plays, with the design that makes them again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.kinds import Kind

__all__ = ["JSON", "Excitation"]

JSON: TypeAlias = "bool | int | float | str | Sequence[JSON] | Mapping[str, JSON] | None"


def _frozen(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    array = np.array(values, dtype=np.float64, order="C")
    if array.ndim != 1 or array.size == 0:
        raise DesignError(f"{name} has shape {array.shape}: it must be a 1-D array with at least one sample")
    if not np.isfinite(array).all():
        first = int(np.flatnonzero(~np.isfinite(array))[0])
        raise DesignError(f"{name}: sample {first} is {array[first]}: every sample must be a finite number")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Excitation:
    """Set-points on one uniform time base; the arrays are copies and read-only.

    ``period_samples`` is 0 where the signal is not periodic. ``design`` is the configuration that makes the
    same bytes again, ``figures`` what the design achieved (coverage, crest factor, binding limit …).
    """

    kind: Kind
    sample_rate_hz: float
    period_samples: int
    displacement_m: NDArray[np.float64]  # (N,)
    current_a: NDArray[np.float64] | None = None  # (N,); None for a passive damper
    design: Mapping[str, JSON] = field(default_factory=dict)
    figures: Mapping[str, JSON] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise DesignError(f"sample_rate is {self.sample_rate_hz} Hz: it must be a positive number")
        object.__setattr__(self, "displacement_m", _frozen("displacement", self.displacement_m))
        if self.current_a is not None:
            object.__setattr__(self, "current_a", _frozen("current", self.current_a))
            if self.current_a.size != self.samples:
                raise DesignError(
                    f"current has {self.current_a.size} samples and displacement {self.samples}: "
                    "both need the same number"
                )
        if not 0 <= self.period_samples <= self.samples:
            raise DesignError(
                f"period_samples is {self.period_samples}: it must lie in 0 … {self.samples}; 0: not periodic"
            )

    @property
    def samples(self) -> int:
        return int(self.displacement_m.size)

    @property
    def duration_s(self) -> float:
        return self.samples / self.sample_rate_hz
