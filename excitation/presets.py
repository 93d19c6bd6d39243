"""Sequences of tests that shock absorber and railway damper laboratories run, as harmonic plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal

from excitation.checks import check_above, check_at_least, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.signal import JSON

__all__ = ["PresetSpec", "harmonic_config"]

_SHARES: Final = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
"""Peak velocities of a series as shares of the largest: close at low speed, where a valve opens."""
_STROKES: Final = (0.2, 0.4, 0.6, 0.8, 1.0)
_SLOW_M_S: Final = 0.005
"""Speed at which gas force and friction are read: the force of the valves is then a small part of a damper's."""
_CREEP_M_S: Final = (0.001, 0.002, 0.005)
_SMALL_STROKE: Final = 0.04
"""Share of the stroke of the dynamic series: a millimetre of 25, where mounts and oil are as soft as the valves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetSpec:
    """One of the sequences, sized by the stroke, the largest velocity and the currents.

    "pvp": one stroke, rising peak velocities. "cvp": one peak velocity, other strokes. "gas-force": slow triangles over
    the stroke, whose mean force is that of the gas. "friction": slower ones over a fifth of it. "shock-dyno": all of
    these. "en-13802": the two kinds of tests of railway dampers, characteristic and dynamic: sines of the stroke at
    shares of the nominal velocity, and sines of a small stroke over frequencies. Which amplitudes, velocities and
    frequencies EN 13802 asks for stands in the specification of each damper: give them in ``amplitude``,
    ``max_velocity``, ``velocities`` and ``frequencies``.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    preset: Literal["pvp", "cvp", "gas-force", "friction", "shock-dyno", "en-13802"]
    sample_rate_hz: float
    amplitude_m: float
    max_velocity_m_s: float
    velocities_m_s: tuple[float, ...] = ()  # none: shares of the largest
    frequencies_hz: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0)  # of the dynamic series
    current_a: tuple[float, ...] = ()  # none: a passive damper
    cycles: int = 5
    settling_cycles: int = 2
    dwell_s: float = 5.0
    min_temperature_degc: float | None = None
    max_temperature_degc: float | None = None

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        check_above("amplitude", self.amplitude_m, 0.0, "m")
        check_above("max_velocity", self.max_velocity_m_s, 0.0, "m/s")
        for name, values in (("velocities", self.velocities_m_s), ("frequencies", self.frequencies_hz)):
            for value in values:
                check_above(name, value, 0.0)
        check_at_least("cycles", self.cycles, 1)
        check_within("dwell", self.dwell_s, 0.0, 86400.0, "s")
        if not self.frequencies_hz:
            raise DesignError("frequencies is an empty list: give those of the dynamic series")


def harmonic_config(spec: PresetSpec) -> dict[str, JSON]:
    """The configuration of the harmonic plan, its tests in the listed order, mild before severe."""
    config: dict[str, JSON] = {
        "sample_rate": spec.sample_rate_hz,
        "cycles": spec.cycles,
        "settling_cycles": spec.settling_cycles,
        "dwell": spec.dwell_s,
        "order": {"method": "listed"},
        "series": [_with_current(spec, series) for make in _PRESETS[spec.preset] for series in make(spec)],
    }
    gates = {"min_temperature": spec.min_temperature_degc, "max_temperature": spec.max_temperature_degc}
    return config | {key: value for key, value in gates.items() if value is not None}


def _with_current(spec: PresetSpec, series: dict[str, JSON]) -> dict[str, JSON]:
    return {**series, "current": list(spec.current_a)} if spec.current_a else series


def _velocities(spec: PresetSpec) -> list[float]:
    return list(spec.velocities_m_s) or [float(f"{share * spec.max_velocity_m_s:.4g}") for share in _SHARES]


def _pvp(spec: PresetSpec) -> list[dict[str, JSON]]:
    return [{"name": "pvp", "amplitude": spec.amplitude_m, "peak_velocity": _velocities(spec)}]


def _cvp(spec: PresetSpec) -> list[dict[str, JSON]]:
    strokes = [float(f"{share * spec.amplitude_m:.4g}") for share in _STROKES]
    return [{"name": "cvp", "peak_velocity": spec.max_velocity_m_s, "amplitude": strokes}]


def _gas_force(spec: PresetSpec) -> list[dict[str, JSON]]:
    return [_slow("gas_force", spec.amplitude_m, [_SLOW_M_S])]


def _friction(spec: PresetSpec) -> list[dict[str, JSON]]:
    return [_slow("friction", 0.2 * spec.amplitude_m, list(_CREEP_M_S))]


def _slow(name: str, amplitude_m: float, speeds_m_s: list[float]) -> dict[str, JSON]:
    """Triangles whose turning points take a tenth of a second."""
    return {
        "name": name,
        "wave_form": "triangle",
        "amplitude": float(f"{amplitude_m:.4g}"),
        "peak_velocity": speeds_m_s,
        "corner_time": 0.1,
        "cycles": 2,
        "settling_cycles": 1,
    }


def _characteristic(spec: PresetSpec) -> list[dict[str, JSON]]:
    return [{"name": "characteristic", "amplitude": spec.amplitude_m, "peak_velocity": _velocities(spec)}]


def _dynamic(spec: PresetSpec) -> list[dict[str, JSON]]:
    small = float(f"{_SMALL_STROKE * spec.amplitude_m:.4g}")
    return [{"name": "dynamic", "amplitude": small, "frequency": list(spec.frequencies_hz)}]


_PRESETS: Final[Mapping[str, tuple[Callable[[PresetSpec], list[dict[str, JSON]]], ...]]] = {
    "pvp": (_pvp,),
    "cvp": (_cvp,),
    "gas-force": (_gas_force,),
    "friction": (_friction,),
    "shock-dyno": (_gas_force, _friction, _pvp, _cvp),
    "en-13802": (_characteristic, _dynamic),
}
