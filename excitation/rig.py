"""What a rig can do: limits of motion, force, hydraulics, control and temperature, from one TOML file."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

from excitation.checks import check_above, check_at_least
from excitation.configuration import STRICT, key_of, read_config, to_spec
from excitation.errors import DesignError

__all__ = [
    "Control",
    "Envelope",
    "ForceLimits",
    "Hydraulics",
    "MotionLimits",
    "Specimen",
    "TemperatureWindow",
    "read_envelope",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLimits:
    """Largest deflection from the middle, speed, acceleration, and the frequency up to which the rig
    follows.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    max_displacement_m: float
    max_velocity_m_s: float
    max_acceleration_m_s2: float | None = None
    bandwidth_hz: float | None = None

    def __post_init__(self) -> None:
        _all_above_zero(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceLimits:
    """``static`` is the stall force of the actuator; ``dynamic`` is its force while it moves."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    static_n: float
    dynamic_n: float

    def __post_init__(self) -> None:
        _all_above_zero(self)
        if self.dynamic_n > self.static_n:
            raise DesignError(f"dynamic is {self.dynamic_n:g} N: it must not exceed static ({self.static_n:g} N)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Hydraulics:
    """Where the oil comes from.

    The servo-valve passes Q = rated_flow·sqrt(Δp/rated_pressure_drop), Δp being what the load leaves of the
    supply; the pump gives its flow all the time, and the accumulator supplies up to ``accumulator_volume``
    (usable oil) at peaks.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    piston_area_m2: float
    supply_pressure_pa: float
    valve_rated_flow_m3_s: float
    valve_rated_pressure_drop_pa: float
    pump_flow_m3_s: float
    accumulator_volume_m3: float = 0.0
    return_pressure_pa: float = 0.0

    def __post_init__(self) -> None:
        for name in ("accumulator_volume_m3", "return_pressure_pa"):
            check_at_least(key_of(name), getattr(self, name), 0.0)
        _all_above_zero(self, but=("accumulator_volume_m3", "return_pressure_pa"))
        if self.return_pressure_pa >= self.supply_pressure_pa:
            raise DesignError(
                f"return_pressure is {self.return_pressure_pa:g} Pa: it must lie below supply_pressure "
                f"({self.supply_pressure_pa:g} Pa)"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """Sample rates that the controller knows, and the range of the control current."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rates_hz: tuple[float, ...] = ()  # empty: any
    min_current_a: float | None = None
    max_current_a: float | None = None

    def __post_init__(self) -> None:
        for rate in self.sample_rates_hz:
            check_above("sample_rates", rate, 0.0, "Hz")
        low, high = self.min_current_a, self.max_current_a
        if low is not None and high is not None and not low < high:
            raise DesignError(f"max_current is {high:g} A: it must be above min_current ({low:g} A)")


@dataclass(frozen=True, slots=True, kw_only=True)
class TemperatureWindow:
    """Temperatures at which the damper may be tested."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    min_degc: float
    max_degc: float

    def __post_init__(self) -> None:
        if not self.min_degc < self.max_degc:
            raise DesignError(f"max is {self.max_degc:g} °C: it must be above min ({self.min_degc:g} °C)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """A rough model of the damper, to predict force and heat: F = (damping + damping_control·i)·v +
    friction·sgn(v).

    Heat: heat_capacity·dT/dt = F·v − cooling·(T − ambient).
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    damping_n_s_m: float
    damping_control: float = 0.0  # N·s/(m·A)
    friction_n: float = 0.0
    heat_capacity_j_k: float | None = None
    cooling_w_k: float = 0.0
    ambient_degc: float = 20.0

    def __post_init__(self) -> None:
        check_at_least("damping", self.damping_n_s_m, 0.0, "N·s/m")
        check_at_least("friction", self.friction_n, 0.0, "N")
        check_at_least("cooling", self.cooling_w_k, 0.0, "W/K")
        if self.heat_capacity_j_k is not None:
            check_above("heat_capacity", self.heat_capacity_j_k, 0.0, "J/K")


@dataclass(frozen=True, slots=True, kw_only=True)
class Envelope:
    """What a rig can do; a section that is left out is not checked."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    motion: MotionLimits
    name: str = ""
    force: ForceLimits | None = None
    hydraulics: Hydraulics | None = None
    control: Control = field(default_factory=Control)
    temperature: TemperatureWindow | None = None
    specimen: Specimen | None = None


def read_envelope(path: Path | str) -> Envelope:
    """The envelope in a TOML file; raises DesignError, one line with file, key, value and what would be
    right.
    """
    path = Path(path)
    return to_spec(Envelope, read_config(path), str(path))


def _all_above_zero(limits: MotionLimits | ForceLimits | Hydraulics, but: tuple[str, ...] = ()) -> None:
    for name in (f.name for f in fields(limits) if f.name not in but):
        value = getattr(limits, name)
        if value is not None:
            check_above(key_of(name), value, 0.0)
