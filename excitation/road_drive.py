"""The stroke of a suspension on a road of ISO 8608 at a speed: what its damper is moved by."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from excitation.bounds import Bounds
from excitation.checks import check_above, check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError
from excitation.kinds import Kind
from excitation.periodic import Multitone
from excitation.portable_math import angle_turns
from excitation.road_profile import RoadProfileSpec, road_tones
from excitation.signal import Excitation
from excitation.spectra import QuarterCar
from excitation.tone_drive import tone_drive

__all__ = ["RoadDriveSpec", "road_drive", "stroke_over_road"]

_MOST_SAMPLES: Final = 2**24


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadDriveSpec:
    """The steady stroke of a quarter car that drives over a periodic road at a constant speed.

    Lines above ``f_max`` are left out: a rig does not follow them. ``speed`` becomes the nearest that gives a whole
    number of samples on the road.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    road: RoadProfileSpec
    speed_m_s: float
    bounds: Bounds
    quarter_car: QuarterCar = field(default_factory=QuarterCar)
    f_max_hz: float = 50.0
    periods: int = 1
    level: float = 1.0
    current_a: float | None = None

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        check_within("speed", self.speed_m_s, 0.01, 200.0, "m/s")
        check_within("f_max", self.f_max_hz, 0.0, 0.125 * self.sample_rate_hz, "Hz")
        check_within("level", self.level, 1e-6, 1e3)
        if not self.road.periodic:
            raise DesignError("road.periodic is false: a rig plays a road that closes")
        samples = self.road.length_m / self.speed_m_s * self.sample_rate_hz
        if not 8 <= samples <= _MOST_SAMPLES:
            raise DesignError(f"road.length is {self.road.length_m:g} m: {samples:.3g} samples; 8 … {_MOST_SAMPLES}")
        check_within("periods", self.periods, 1, max(1, int(_MOST_SAMPLES / samples)))


def road_drive(spec: RoadDriveSpec) -> Excitation:
    """The stroke, positive where body and wheel move apart, period after period.

    Each line of the road times ``stroke_over_road``. Raises DesignError where no line is left below ``f_max``, or the
    stroke exceeds its bounds.
    """
    samples = round(spec.road.length_m / spec.speed_m_s * spec.sample_rate_hz)
    speed_m_s = spec.road.length_m * spec.sample_rate_hz / samples
    highest = min(spec.road.max_wavenumber_per_m, spec.f_max_hz / speed_m_s)
    try:
        height = road_tones(replace(spec.road, max_wavenumber_per_m=highest), samples)
    except DesignError as error:
        raise error.below("road") from error
    transfer = stroke_over_road(height.lines.astype(np.float64) * (spec.sample_rate_hz / samples), spec.quarter_car)
    turned = height.phase_turns + angle_turns(transfer.real, transfer.imag)
    stroke = Multitone(
        period_samples=samples,
        lines=height.lines,
        amplitude=height.amplitude * np.abs(transfer),
        phase_turns=turned - np.floor(turned),
    )
    return tone_drive(
        stroke,
        sample_rate_hz=spec.sample_rate_hz,
        periods=spec.periods,
        bounds=spec.bounds,
        level=spec.level,
        current_a=spec.current_a,
        kind=Kind.ROAD,
        design={"kind": str(Kind.ROAD), **to_config(replace(spec, speed_m_s=speed_m_s))},
    )


def stroke_over_road(frequency_hz: NDArray[np.float64], car: QuarterCar) -> NDArray[np.complex128]:
    """(z_s − z_u)/z_road of a quarter car, (K,), from its two equations of motion.

    With G = (k_s + jcω)/(m_s·ω²): body and wheel are G·s and (G − 1)·s, s the stroke, and
    s = k_t·z_road/((k_t − m_u·ω²)·(G − 1) − k_s − jcω).

    References
    ----------
    Hrovat, Automatica 33 (1997): the quarter car as a sufficient approximation of vertical dynamics.
    """
    omega = 2.0 * np.pi * frequency_hz
    strut = car.spring_rate_n_m + 1j * car.damping_n_s_m * omega
    body = strut / (car.sprung_mass_kg * omega**2)
    wheel = (car.tyre_rate_n_m - car.unsprung_mass_kg * omega**2) * (body - 1.0)
    return np.asarray(car.tyre_rate_n_m / (wheel - strut))
