"""Limits that a person gives: those of a test, and those that an envelope sets for every test of a rig or specimen."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite
from typing import Any, ClassVar

from excitation.configuration import STRICT, key_of
from excitation.errors import DesignError
from excitation.rig import Envelope

__all__ = ["TestLimits", "limits_of"]

_SIGNED = ("min_current_a", "max_current_a", "max_temperature_degc")


@dataclass(frozen=True, slots=True, kw_only=True)
class TestLimits:
    """Limits of one test; what is left out is limited by the machine and the specimen only."""

    __test__ = False  # the name starts with "Test": pytest must not collect it
    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    max_displacement_m: float | None = None  # from mid-stroke, either way
    max_velocity_m_s: float | None = None
    max_acceleration_m_s2: float | None = None
    max_force_n: float | None = None  # either way
    max_following_error_m: float | None = None
    min_current_a: float | None = None  # 0 or below: the rig is switched off without current
    max_current_a: float | None = None  # 0 or above
    max_temperature_degc: float | None = None  # of the damper

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if value is None:
                continue
            if not isfinite(value) or (one.name not in _SIGNED and value <= 0):
                raise DesignError(f"limits: {key_of(one.name)} is {value}: it must be positive and finite")
        low, high = self.min_current_a, self.max_current_a
        if (low is not None and low > 0) or (high is not None and high < 0):
            raise DesignError(f"limits: current {low} … {high} A: 0 must lie inside, a rig stops without current")


def limits_of(envelope: Envelope) -> TestLimits:
    """The limits of an envelope that hold for every sample; flow, bandwidth and heat are predictions of a design."""
    motion, control = envelope.motion, envelope.control
    low, high = control.min_current_a, control.max_current_a
    return TestLimits(
        max_displacement_m=motion.max_displacement_m,
        max_velocity_m_s=motion.max_velocity_m_s,
        max_acceleration_m_s2=motion.max_acceleration_m_s2,
        max_force_n=None if envelope.force is None else envelope.force.dynamic_n,
        min_current_a=None if low is None else min(low, 0.0),
        max_current_a=None if high is None else max(high, 0.0),
        max_temperature_degc=None if envelope.temperature is None else envelope.temperature.max_degc,
    )
