"""A linear estimate of the force that a motion asks of the rig, to keep it within a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from excitation.checks import check_above, check_at_least
from excitation.configuration import STRICT
from excitation.errors import DesignError

__all__ = ["ForceEstimate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceEstimate:
    """F = stiffness·x + (damping + damping_control·i)·v + mass·a + friction·sgn(v), i the largest current."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    max_n: float
    damping_n_s_m: float = 0.0
    damping_control: float = 0.0  # N·s/(m·A)
    stiffness_n_m: float = 0.0
    mass_kg: float = 0.0  # between the load cell and the damper
    friction_n: float = 0.0

    def __post_init__(self) -> None:
        check_above("max", self.max_n, 0.0, "N")
        check_at_least("damping", self.damping_n_s_m, 0.0, "N·s/m")
        check_at_least("damping_control", self.damping_control, 0.0, "N·s/(m·A)")
        check_at_least("stiffness", self.stiffness_n_m, 0.0, "N/m")
        check_at_least("mass", self.mass_kg, 0.0, "kg")
        check_at_least("friction", self.friction_n, 0.0, "N")
        if self.damping_n_s_m + self.damping_control + self.stiffness_n_m + self.mass_kg <= 0.0:
            raise DesignError("force has no damping, stiffness or mass: give one, or leave force out")
        if self.friction_n >= self.max_n:
            raise DesignError(f"friction is {self.friction_n:g} N: it must lie below max ({self.max_n:g} N)")
