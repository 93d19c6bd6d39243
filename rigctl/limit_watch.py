"""The limits on the samples that come back while the rig moves, by the host.

The rig watches the same limits and acts first. The host acts where the rig does not: a controller without such
detectors, or one whose limit was not set.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.interlocks import first_trip
from rigctl.limits import Limits

__all__ = ["LimitWatch", "Watched"]

OVERTRAVEL_M: Final = 0.003  # measured position beyond the limit of the set-points, as on the rig
CURRENT_SHARE: Final = 0.05  # of the largest current: overshoot of a current source at a step
# Twice and more what the rig's own detectors wait for, so that the rig stops by itself first and says why.
POSITION_S: Final = 0.01
FORCE_S: Final = 0.01
CURRENT_S: Final = 0.05
FOLLOWING_S: Final = 0.05
TEMPERATURE_S: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """One quantity, its limits, and how long a violation must last."""

    name: str
    unit: str
    low: float
    high: float
    delay_s: float


class LimitWatch:
    """Says which limit the captured samples exceed; a violation must last for its delay."""

    def __init__(self, limits: Limits, sample_rate_hz: float) -> None:
        spare = CURRENT_SHARE * max(limits.current_max_a, -limits.current_min_a)
        coldest = float("-inf")  # a damper is not stopped for being cold
        self._watched = (
            Watched(name="force", unit="N", low=-limits.force_n, high=limits.force_n, delay_s=FORCE_S),
            Watched(
                name="displacement",
                unit="m",
                low=limits.position_min_m - OVERTRAVEL_M,
                high=limits.position_max_m + OVERTRAVEL_M,
                delay_s=POSITION_S,
            ),
            Watched(
                name="current",
                unit="A",
                low=limits.current_min_a - spare,
                high=limits.current_max_a + spare,
                delay_s=CURRENT_S,
            ),
            Watched(
                name="temperature", unit="°C", low=coldest, high=limits.temperature_max_degc, delay_s=TEMPERATURE_S
            ),
            Watched(
                name="following error",
                unit="m",
                low=-limits.following_error_m,
                high=limits.following_error_m,
                delay_s=FOLLOWING_S,
            ),
        )
        self._rate_hz = sample_rate_hz
        self._lasting = [0] * len(self._watched)

    def exceeded(self, values: NDArray[np.float64], command_m: NDArray[np.float64]) -> str | None:
        """What the next samples, (n, 5), with their set-points, (n,), exceed, in words; None where all is well."""
        quantities = (*values.T[:4], values[:, 1] - command_m)
        for k, (one, measured) in enumerate(zip(self._watched, quantities, strict=True)):
            violated = ~((measured >= one.low) & (measured <= one.high))  # the negation catches NaN too
            needed = max(round(one.delay_s * self._rate_hz), 1)
            sample, self._lasting[k] = first_trip(violated, self._lasting[k], needed)
            if sample is not None:
                return (
                    f"limit: {one.name} {measured[sample]:.6g} {one.unit}, outside {one.low:g} … {one.high:g} "
                    f"for {one.delay_s:g} s"
                )
        return None
