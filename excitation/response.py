"""How a rig follows its commands: gain and phase of displacement and current over frequency."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_at_least, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.portable_math import angle_turns

__all__ = ["Gains", "Lag", "ResponseTable", "RigResponse", "gains"]

Gains = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Gain and phase in turns of each line, both (K,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lag:
    """A first-order lag 1/(1 + jf/f_b), or a second-order one with f_b its natural frequency; and a delay."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    bandwidth_hz: float
    order: Literal[1, 2] = 1
    damping_ratio: float = 0.7  # order 2
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        check_above("bandwidth", self.bandwidth_hz, 0.0, "Hz")
        check_within("damping_ratio", self.damping_ratio, 0.05, 10.0)
        check_at_least("delay", self.delay_s, 0.0, "s")


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseTable:
    """Measured gain and phase, linear between the frequencies."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    frequency_hz: tuple[float, ...]
    gain: tuple[float, ...]
    phase_deg: tuple[float, ...]  # unwrapped, negative where the rig lags

    def __post_init__(self) -> None:
        sizes = {len(self.frequency_hz), len(self.gain), len(self.phase_deg)}
        if len(sizes) > 1 or min(sizes) < 2:
            raise DesignError(
                f"frequency, gain and phase have {len(self.frequency_hz)}, {len(self.gain)} and {len(self.phase_deg)} "
                "values: a response needs the same number of each, at least two"
            )
        if any(later <= earlier for earlier, later in pairwise(self.frequency_hz)):
            raise DesignError("frequency does not rise from value to value: sort it and drop repeated values")
        if min(self.gain) <= 0.0:
            raise DesignError(f"gain falls to {min(self.gain):g}: it must be above 0 everywhere")
        step = max((abs(b - a) for a, b in pairwise(self.phase_deg)), default=0.0)
        if step > 180.0:
            raise DesignError(f"phase steps by {step:g}° between two frequencies: unwrap it, or give more frequencies")


@dataclass(frozen=True, slots=True, kw_only=True)
class RigResponse:
    """What the damper gets of each command; a channel that is left out is followed exactly."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    displacement: Lag | ResponseTable | None = None
    current: Lag | ResponseTable | None = None

    def __post_init__(self) -> None:
        if self.displacement is None and self.current is None:
            raise DesignError("response is empty: give displacement or current, or leave it out")


def gains(response: Lag | ResponseTable | None, frequency_hz: NDArray[np.float64]) -> Gains:
    """Gain and phase of a channel at frequencies (K,); 1 and 0 without a response.

    Raises DesignError where a table does not span the frequencies.
    """
    match response:
        case None:
            return np.ones_like(frequency_hz), np.zeros_like(frequency_hz)
        case Lag():
            return _of_lag(response, frequency_hz)
        case ResponseTable():
            return _of_table(response, frequency_hz)


def _of_lag(lag: Lag, frequency_hz: NDArray[np.float64]) -> Gains:
    ratio = frequency_hz / lag.bandwidth_hz
    real = np.ones_like(ratio) if lag.order == 1 else 1.0 - ratio * ratio
    imaginary = ratio if lag.order == 1 else 2.0 * lag.damping_ratio * ratio
    turns = -angle_turns(real, imaginary) - frequency_hz * lag.delay_s
    return 1.0 / np.sqrt(real * real + imaginary * imaginary), turns


def _of_table(known: ResponseTable, frequency_hz: NDArray[np.float64]) -> Gains:
    low, high = known.frequency_hz[0], known.frequency_hz[-1]
    if frequency_hz[0] < low * (1 - 1e-9) or frequency_hz[-1] > high * (1 + 1e-9):
        raise DesignError(
            f"response: frequency reaches from {low:g} to {high:g} Hz: it must span the excited band, "
            f"{frequency_hz[0]:g} to {frequency_hz[-1]:g} Hz"
        )
    turns = np.interp(frequency_hz, known.frequency_hz, known.phase_deg) / 360.0
    return np.interp(frequency_hz, known.frequency_hz, known.gain), turns
