"""Bounds of a motion that has an amplitude of its own: it is refused beyond them, or scaled down to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal

from excitation.checks import check_above
from excitation.configuration import STRICT
from excitation.errors import DesignError

__all__ = ["Bounds"]

_SHARE: Final = 1.0 - 1e-9  # of a bound that is used, so that rounding, here or in a reader, does not exceed it


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Largest displacement from the middle, speed and acceleration, and what follows where a signal has more."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    max_displacement_m: float
    max_velocity_m_s: float
    max_acceleration_m_s2: float | None = None
    beyond: Literal["refuse", "scale"] = "refuse"

    def __post_init__(self) -> None:
        check_above("max_displacement", self.max_displacement_m, 0.0, "m")
        check_above("max_velocity", self.max_velocity_m_s, 0.0, "m/s")
        if self.max_acceleration_m_s2 is not None:
            check_above("max_acceleration", self.max_acceleration_m_s2, 0.0, "m/s²")

    def largest_factor(self, peaks: tuple[float, float, float]) -> float:
        """The factor on a motion with these peaks, m, m/s, m/s², that just reaches the first bound."""
        limits = (self.max_displacement_m, self.max_velocity_m_s, self.max_acceleration_m_s2)
        shares = [peak / limit for peak, limit in zip(peaks, limits, strict=True) if limit is not None]
        if not 0.0 < max(shares) < float("inf"):
            raise DesignError(f"its peak is {peaks[0]:g} m: there is no motion that a rig could play")
        return _SHARE / max(shares)

    def factor(self, peaks: tuple[float, float, float], level: float) -> float:
        """What a motion with these peaks is multiplied by: ``level``, and before it what makes it fit where it may be
        scaled.

        Raises DesignError where it may not: with the peaks, the bounds and the level that fits.
        """
        largest = self.largest_factor(peaks)
        if self.beyond == "scale":
            return level * min(1.0, largest)
        if level * _SHARE <= largest:  # on the bound but for rounding
            return min(level, largest)
        x, v, a = (level * peak for peak in peaks)
        raise DesignError(
            f"bounds: the signal reaches {x:.4g} m, {v:.4g} m/s and {a:.4g} m/s²: level = {_down(largest):g} fits, "
            'or give bounds.beyond = "scale"'
        )


def _down(value: float) -> float:
    """Three digits, not above the value."""
    rounded = float(f"{value:.3g}")
    return rounded if rounded <= value else float(f"{0.999 * value:.3g}")
