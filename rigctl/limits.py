"""Limits of a rig, and the configuration that a host writes before a test."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any, ClassVar, Final

from excitation.configuration import STRICT
from rigctl.device import PressureStage
from rigctl.errors import LimitError

JOG_S: Final = 0.25
"""How long a request to jog lasts: the piston comes to rest unless it is renewed. Renewals come at least every 0.1 s,
so one may be lost. At 10 mm/s the piston goes on by 2.5 mm at most; with half of it a busy computer makes it stutter,
with double it goes on twice as far after the hand has let go."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of position, motion, force, current and temperature."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    position_min_m: float = -0.08
    position_max_m: float = 0.08
    velocity_m_s: float = 2.0
    acceleration_m_s2: float = 60.0  # of set-points, and of the rig's own movements: travel, stop
    force_n: float = 25e3
    current_min_a: float = 0.0
    current_max_a: float = 2.0
    temperature_max_degc: float = 110.0
    following_error_m: float = 0.03

    def __post_init__(self) -> None:
        for field in fields(self):
            if not isfinite(getattr(self, field.name)):
                raise LimitError(f"{field.name} is {getattr(self, field.name)}: it must be finite")
        for name in ("velocity_m_s", "acceleration_m_s2", "force_n", "following_error_m"):
            if getattr(self, name) <= 0:
                raise LimitError(f"{name} is {getattr(self, name)}: it must be positive")
        if not self.position_min_m < 0 < self.position_max_m:
            raise LimitError(
                f"position limits {self.position_min_m} … {self.position_max_m} m: 0 must lie between them"
            )
        if not self.current_min_a <= 0 <= self.current_max_a:
            raise LimitError(f"current limits {self.current_min_a} … {self.current_max_a} A: 0 must lie inside")


def tighter(a: Limits, b: Limits) -> Limits:
    """Return the limits that are within both."""
    lower = {"position_min_m", "current_min_a"}
    return Limits(
        **{
            field.name: (max if field.name in lower else min)(getattr(a, field.name), getattr(b, field.name))
            for field in fields(Limits)
        }
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LowPressure:
    """What the rig keeps to at low pressure, for hands near it."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    velocity_m_s: float
    force_n: float

    def __post_init__(self) -> None:
        for name in ("velocity_m_s", "force_n"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise LimitError(f"low pressure: {name} is {value}: it must be positive")

    def within(self, limits: Limits) -> Limits:
        """The limits, made tighter by those of low pressure."""
        return tighter(limits, replace(limits, velocity_m_s=self.velocity_m_s, force_n=self.force_n))


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """The configuration of a run, written while the rig is disabled."""

    sample_rate_hz: float = 1000.0
    prefill_samples: int = 1024
    low_water_samples: int = 1024
    high_water_samples: int = 3072
    heartbeat_s: float = 0.5  # the rig stops when the host is silent for longer
    limits: Limits = Limits()
    stage: PressureStage = PressureStage.HIGH  # of the power that HOLD switches on
    further_axes: bool = False  # whether captured samples have the channels of further axes

    def __post_init__(self) -> None:
        if self.stage is PressureStage.OFF:
            raise LimitError("stage is OFF: it must be LOW or HIGH")
        if not (isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise LimitError(f"sample_rate is {self.sample_rate_hz} Hz: it must be positive")
        if not 0 < self.prefill_samples <= self.high_water_samples:
            raise LimitError(f"prefill is {self.prefill_samples}: it must lie in 1 … {self.high_water_samples}")
        if not 0 <= self.low_water_samples < self.high_water_samples:
            raise LimitError(f"low water is {self.low_water_samples}: it must lie below {self.high_water_samples}")
        if self.heartbeat_s < 0.25:
            raise LimitError(f"heartbeat is {self.heartbeat_s} s: gaps of 24 ms are normal, it must be 0.25 s or more")
