"""A range of working points that samples should fill evenly: an interval for each variable, an ellipse for a variable
and its derivative."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.portable_math import angle_turns

__all__ = ["Region", "Variable", "derivative_pair"]

Variable = Literal["displacement", "velocity", "acceleration", "current"]

_DERIVATIVE_OF: Mapping[str, str] = {"velocity": "displacement", "acceleration": "velocity"}


def derivative_pair(names: Sequence[Variable]) -> tuple[int, int] | None:
    """Places of a variable and of its derivative among ``names``; None where no variable is another's derivative."""
    for place, name in enumerate(names):
        below = _DERIVATIVE_OF.get(name)
        if below in names:
            return list(names).index(below), place  # type: ignore[arg-type]  # it is one of the names
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Intervals low … high of the variables; the two of ``pair`` fill the ellipse that touches their intervals.

    Why an ellipse: while samples are even over a region of (x, ẋ), its boundary is a line that the motion follows
    (v²/2 + Φ(x) constant: no sample may cross it). At an edge of a box the motion would have to reverse at once.
    A band-limited motion cannot do so: abs(x) ≤ X and no line above ω give x² + (ẋ/ω)² ≤ X² (Duffin & Schaeffer, Trans.
    Amer. Math. Soc. 44, 1938).
    """

    names: tuple[Variable, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    pair: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        for name, low, high in zip(self.names, self.low, self.high, strict=True):
            if not low < high:
                raise DesignError(f"{name} reaches from {low:g} to {high:g}: a range cannot be covered without motion")

    @property
    def area(self) -> float:
        """Product of the intervals, times π/4 where two of them are an ellipse's."""
        box = float(np.prod(np.subtract(self.high, self.low)))
        return box if self.pair is None else 0.25 * np.pi * box

    def unit(self, variables: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """The variables, each (N,), on −1 … 1 over their intervals; those of a pair inside the unit disc."""
        limits = zip(variables, self.low, self.high, strict=True)
        return [np.asarray((2.0 * u - (high + low)) / (high - low)) for u, low, high in limits]

    def square(self, variables: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """As ``unit``, with the disc of the pair mapped to the square −1 … 1, areas kept: cells of equal size in the
        square are cells of equal area in the ellipse. Samples outside the region lie outside the square.

        References
        ----------
        Shirley & Chiu, Journal of Graphics Tools 2 (1997): a low distortion map between disk and square.
        """
        made = self.unit(variables)
        if self.pair is not None:
            first, second = self.pair
            made[first], made[second] = _disc_to_square(made[first], made[second])
        return made


def _disc_to_square(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Circles become squares around the origin, each quarter of the disc (around an axis) a quarter of the square."""
    radius, turns = np.sqrt(x * x + y * y), angle_turns(x, y)
    quarter = np.rint(4.0 * turns)
    along = radius * (turns - 0.25 * quarter) * 8.0
    which = quarter.astype(np.int64) & 3
    return (
        np.choose(which, [radius, -along, -radius, along]),
        np.choose(which, [along, radius, -along, -radius]),
    )
