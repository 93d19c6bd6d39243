"""Road profiles of the classes A to H of ISO 8608, over distance and at a speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_one_of, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.periodic import Multitone
from excitation.portable_math import uniform

__all__ = [
    "ROUGHNESS_M3",
    "RoadClass",
    "RoadProfileSpec",
    "RoadRide",
    "ride",
    "road_density",
    "road_profile",
    "road_tones",
]

RoadClass = Literal["A", "B", "C", "D", "E", "F", "G", "H"]

ROUGHNESS_M3: Final[Mapping[str, float]] = {
    name: 16e-6 * 4.0**number for number, name in enumerate(("A", "B", "C", "D", "E", "F", "G", "H"))
}
"""Gd(n0), the displacement density at n0, of each class: the geometric mean of its limits (ISO 8608:2016).

The limits of a class lie at half and at twice its value.
"""
REFERENCE_PER_M: Final = 0.1  # n0 of ISO 8608, cycles a metre

_MOST_SAMPLES = 2**24


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadProfileSpec:
    """A road of ``length`` whose density is that of the class: Gd(n) = Gd(n0)·(n/n0)^−waviness.

    ``periodic``: the road continues at its end with its beginning. A road that does not is cut from one of twice the
    length.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    road_class: RoadClass
    length_m: float
    seed: int = 0
    realisation: int = 0  # another road of the same class
    min_wavenumber_per_m: float = 0.01  # cycles a metre; 0.01 … 10 is usual for roads
    max_wavenumber_per_m: float = 10.0
    waviness: float = 2.0
    periodic: bool = True

    def __post_init__(self) -> None:
        check_one_of("road_class", self.road_class, tuple(ROUGHNESS_M3))
        check_within("length", self.length_m, 0.1, 1e7, "m")
        check_within("seed", self.seed, 0, 2**63 - 1)
        check_within("realisation", self.realisation, 0, 2**63 - 1)
        check_within("min_wavenumber", self.min_wavenumber_per_m, 1e-4, 1e3, "1/m")
        check_within("max_wavenumber", self.max_wavenumber_per_m, 1e-4, 1e3, "1/m")
        check_within("waviness", self.waviness, 0.0, 6.0)
        lines = self.wave_lines
        if lines.size == 0:
            raise DesignError(
                f"min_wavenumber … max_wavenumber is {self.min_wavenumber_per_m:g} … {self.max_wavenumber_per_m:g} /m: "
                f"no line of a road of {self.length_m:g} m lies there; widen it or raise length"
            )

    @property
    def period_m(self) -> float:
        """The length after which the sum of lines repeats."""
        return self.length_m if self.periodic else 2.0 * self.length_m

    @property
    def wave_lines(self) -> NDArray[np.int64]:
        """Whole numbers of waves on ``period_m``, from the lowest to the highest wavenumber; (K,)."""
        tiny = 1e-9  # a line on the edge up to rounding belongs to the band
        first = max(1, int(np.ceil(self.min_wavenumber_per_m * self.period_m - tiny)))
        last = int(np.floor(self.max_wavenumber_per_m * self.period_m + tiny))
        if last > _MOST_SAMPLES // 2:
            raise DesignError(f"length is {self.length_m:g} m: {last} waves; at most {_MOST_SAMPLES // 2}")
        return np.arange(first, last + 1, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadRide:
    """What a wheel that follows the road meets, at even times; arrays (N,)."""

    sample_rate_hz: float
    speed_m_s: float
    period_samples: int  # 0: the road is not periodic
    height_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]  # of the height: its slope times the speed


def road_density(wavenumber_per_m: NDArray[np.float64], road_class: RoadClass, waviness: float = 2.0) -> NDArray[Any]:
    """Gd(n) = Gd(n0)·(n/n0)^−w of the height, (K,) m³, one-sided; n above 0, cycles a metre.

    References
    ----------
    ISO 8608:2016, Mechanical vibration: road surface profiles, reporting of measured data.
    """
    check_one_of("road_class", road_class, tuple(ROUGHNESS_M3))
    return np.asarray(ROUGHNESS_M3[road_class] * (wavenumber_per_m / REFERENCE_PER_M) ** -waviness)


def road_profile(spec: RoadProfileSpec, spacing_m: float) -> NDArray[np.float64]:
    """The height at distances ``spacing_m`` apart from 0 to ``length``, (N,), m; zero mean where it is periodic.

    h(s) = Σ sqrt(2·Gd(n_k)·Δn)·cos(2π(n_k·s + φ_k)), Δn = 1/period, φ_k drawn by seed and realisation: the density
    is met exactly on each line.

    Raises DesignError where ``spacing_m`` does not divide the length or is too wide for the shortest waves.
    """
    check_above("spacing", spacing_m, 0.0, "m")
    samples = _whole(spec.length_m / spacing_m, f"spacing is {spacing_m:g} m: length {spec.length_m:g} m")
    return road_tones(spec, samples).samples()[:samples]


def ride(spec: RoadProfileSpec, speed_m_s: float, sample_rate_hz: float) -> RoadRide:
    """The road met at a constant speed.

    A periodic road takes a whole number of samples: the speed is the nearest that gives one, which differs by less
    than half a sample in the whole, and is stated in the answer.

    Raises DesignError where the shortest waves reach half the sample rate.
    """
    check_above("speed", speed_m_s, 0.0, "m/s")
    check_above("sample_rate", sample_rate_hz, 0.0, "Hz")
    exact = spec.length_m / speed_m_s * sample_rate_hz
    samples = round(exact) if exact <= _MOST_SAMPLES else _MOST_SAMPLES + 1
    tones = road_tones(spec, samples)
    return RoadRide(
        sample_rate_hz=sample_rate_hz,
        speed_m_s=spec.length_m * sample_rate_hz / samples,
        period_samples=samples if spec.periodic else 0,
        height_m=tones.samples()[:samples],
        velocity_m_s=tones.derivative(sample_rate_hz)[:samples],
    )


def _whole(value: float, where: str) -> int:
    number = round(value) if value <= _MOST_SAMPLES else _MOST_SAMPLES + 1
    if number < 1 or abs(value - number) > 1e-6 * max(1.0, value):
        raise DesignError(f"{where} must be a whole number of them, at most {_MOST_SAMPLES}")
    return number


def road_tones(spec: RoadProfileSpec, samples: int) -> Multitone:
    """The lines of the road, m, with ``samples`` on its length; on twice as many where it is not periodic.

    Raises DesignError where so few samples do not show its shortest waves.
    """
    lines, whole = spec.wave_lines, samples if spec.periodic else 2 * samples
    if not 2 <= whole <= 2 * _MOST_SAMPLES:
        raise DesignError(f"length is {spec.length_m:g} m: it gives {samples} samples, 2 … {_MOST_SAMPLES} can be used")
    if 2 * int(lines[-1]) >= whole:
        raise DesignError(
            f"max_wavenumber is {spec.max_wavenumber_per_m:g} /m: {samples} samples on {spec.length_m:g} m show waves "
            f"below {whole / 2 / spec.period_m:.4g} /m; lower it or sample closer"
        )
    wavenumber = lines.astype(np.float64) / spec.period_m
    density = road_density(wavenumber, spec.road_class, spec.waviness)
    return Multitone(
        period_samples=whole,
        lines=lines,
        amplitude=np.sqrt(2.0 * density / spec.period_m),
        phase_turns=uniform((spec.seed, 8, spec.realisation), lines.size),
    )
