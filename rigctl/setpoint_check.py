"""Which set-points a rig may be given: position, speed, acceleration, its jumps, and current.

One rule for both sides: the host checks the whole waveform before the first sample leaves, the rig every sample that
arrives.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.limits import Limits

__all__ = ["RESOLUTION_M", "Bad", "Before", "Quantity", "all_bad", "at_rest"]

RESOLUTION_M: Final = 1e-7  # of a position on the wire
_ROUNDING: Final = 1e-9  # share of a limit: a design that reaches it exactly


class Quantity(Enum):
    """What a set-point violates; the value is its name and unit in a message."""

    POSITION = ("displacement", "m")
    VELOCITY = ("velocity", "m/s")
    ACCELERATION = ("acceleration", "m/s²")
    JUMP = ("jump of the acceleration in one sample", "m/s²")
    CURRENT = ("current", "A")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bad:
    """The first set-point that may not be played, how many there are, and the worst."""

    quantity: Quantity
    sample: int
    value: float
    low: float
    high: float
    count: int
    worst: float

    def __str__(self) -> str:
        name, unit = self.quantity.value
        return (
            f"{name} leaves {self.low:g} … {self.high:g} {unit}: {self.value:.6g} at sample {self.sample}, "
            f"{self.count} samples in all, worst {self.worst:.6g}{_CURE.get(self.quantity, '')}"
        )


_CORNERS: Final = (
    ": round the corners (a triangle's corner_time), fade in for longer, or lower the amplitude, the frequency or f_max"
)
_CURE: Final = {Quantity.ACCELERATION: _CORNERS, Quantity.JUMP: _CORNERS}


@dataclass(frozen=True, slots=True, kw_only=True)
class Before:
    """The three set-points before the first one, m, the latest last."""

    positions_m: tuple[float, float, float]

    def then(self, later: NDArray[np.float64]) -> Before:
        """The three set-points before the next one after `later`, (n,)."""
        third, second, first = (*self.positions_m, *(float(x) for x in later[-3:]))[-3:]
        return Before(positions_m=(third, second, first))


def at_rest(position_m: float) -> Before:
    """The set-points of a rig that stands still."""
    return Before(positions_m=(position_m, position_m, position_m))


def all_bad(
    displacement_m: NDArray[np.float64],
    current_a: NDArray[np.float64],
    before: Before,
    limits: Limits,
    sample_rate_hz: float,
    *,
    resolution_m: float = 0.0,
) -> tuple[Bad, ...]:
    """What the set-points violate, one entry for each quantity; empty where all may be played.

    v_k = (x_k − x_{k−1})·f, a_k = (v_k − v_{k−1})·f, jump_k = a_k − a_{k−1}. The acceleration between two samples is
    limited, so a step of the velocity is refused as well, and its jump by the same number: an actuator that reaches
    its acceleration cannot reverse it within one sample. Positions that were rounded by up to half the resolution r
    may exceed the limits by r·f, 2·r·f² and 4·r·f².

    Parameters
    ----------
    displacement_m, current_a : (n,) arrays
        The set-points that follow `before`.
    resolution_m
        Of positions that came over a wire; 0: as designed.
    """
    x = np.concatenate([before.positions_m, displacement_m])
    velocity = np.diff(x) * sample_rate_hz
    acceleration = np.diff(velocity) * sample_rate_hz
    top, hardest = limits.velocity_m_s, limits.acceleration_m_s2
    step = resolution_m * sample_rate_hz
    found = [
        _outside(Quantity.POSITION, displacement_m, limits.position_min_m, limits.position_max_m, 0.0),
        _outside(Quantity.VELOCITY, velocity[2:], -top, top, step),
        _outside(Quantity.ACCELERATION, acceleration[1:], -hardest, hardest, 2 * step * sample_rate_hz),
        _outside(Quantity.JUMP, np.diff(acceleration), -hardest, hardest, 4 * step * sample_rate_hz),
        _outside(Quantity.CURRENT, current_a, limits.current_min_a, limits.current_max_a, 0.0),
    ]
    return tuple(bad for bad in found if bad is not None)


def _outside(quantity: Quantity, values: NDArray[np.float64], low: float, high: float, slack: float) -> Bad | None:
    rounding = _ROUNDING * max(abs(low), abs(high)) + slack
    where = np.flatnonzero(~((values >= low - rounding) & (values <= high + rounding)))  # the negation catches NaN too
    if not where.size:
        return None
    outside = values[where]
    return Bad(
        quantity=quantity,
        sample=int(where[0]),
        value=float(outside[0]),
        low=low,
        high=high,
        count=int(where.size),
        worst=float(outside[np.argmax(np.abs(outside))]),
    )
