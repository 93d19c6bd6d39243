"""Amplitude spectra by name: the amplitude of each frequency up to a common factor."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_at_least
from excitation.configuration import STRICT
from excitation.errors import DesignError

__all__ = ["QuarterCar", "RecordSpectrum", "Road", "TableSpectrum", "control", "quarter_car", "road", "table"]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuarterCar:
    """A linear quarter car; the defaults are the front corner of a large passenger car."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sprung_mass_kg: float = 400.0
    unsprung_mass_kg: float = 45.0
    spring_rate_n_m: float = 25_000.0
    damping_n_s_m: float = 1_800.0
    tyre_rate_n_m: float = 220_000.0

    def __post_init__(self) -> None:
        check_above("sprung_mass", self.sprung_mass_kg, 0.0, "kg")
        check_above("unsprung_mass", self.unsprung_mass_kg, 0.0, "kg")
        check_at_least("spring_rate", self.spring_rate_n_m, 0.0, "N/m")
        check_above("damping", self.damping_n_s_m, 0.0, "N·s/m")
        check_above("tyre_rate", self.tyre_rate_n_m, 0.0, "N/m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Road:
    """A road whose height spectrum is flat below ``corner_hz`` (speed × spatial corner) and falls as 1/f
    above.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    corner_hz: float = 0.2

    def __post_init__(self) -> None:
        check_at_least("corner", self.corner_hz, 0.0, "Hz")


@dataclass(frozen=True, slots=True, kw_only=True)
class TableSpectrum:
    """Amplitudes at given frequencies, linear between them."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    frequency_hz: tuple[float, ...]
    amplitude: tuple[float, ...]

    def __post_init__(self) -> None:
        check_table(self.frequency_hz, self.amplitude)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordSpectrum:
    """The smoothed amplitude spectrum of a measured service record.

    ``frequency`` and ``amplitude`` are filled in when the record is read, so that the design can be made
    again without it. ``min_contained``: the share of the record's (stroke, velocity) points that the design
    must contain.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    record: str
    channel: str = "displacement"
    min_contained: float = 0.99
    frequency_hz: tuple[float, ...] = ()
    amplitude: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.frequency_hz or self.amplitude:
            check_table(self.frequency_hz, self.amplitude)
        if not 0.0 <= self.min_contained <= 1.0:
            raise DesignError(f"min_contained is {self.min_contained:g}: it must lie in 0 … 1")


def check_table(frequency_hz: tuple[float, ...], amplitude: tuple[float, ...], name: str = "amplitude") -> None:
    """Raises DesignError for a table that is not a function of frequency."""
    if len(frequency_hz) != len(amplitude) or len(frequency_hz) < 2:
        raise DesignError(
            f"frequency has {len(frequency_hz)} values and {name} {len(amplitude)}: "
            "both need the same number, at least two"
        )
    if any(later <= earlier for earlier, later in pairwise(frequency_hz)):
        raise DesignError("frequency does not rise from value to value: sort it and drop repeated values")
    if min(amplitude) < 0 or max(amplitude) <= 0:
        raise DesignError(f"{name} reaches from {min(amplitude):g} to {max(amplitude):g}: none below 0, one above")


def quarter_car(frequency_hz: NDArray[np.float64], car: QuarterCar, on: Road) -> NDArray[np.float64]:
    """Amplitude of the suspension stroke of a quarter car on a road with a first-order spectrum; (K,),
    relative.

    abs(z_s − z_u) / z_road = m_s·ω²·k_t / abs(det) · road(f), from the two equations of motion.

    References
    ----------
    Hrovat, Automatica 33 (1997): the quarter car as a sufficient approximation of vertical dynamics.
    """
    omega = 2.0 * np.pi * frequency_hz
    square = omega * omega
    # det = (k_s − m_s ω² + j c ω)(k_s + k_t − m_u ω² + j c ω) − (k_s + j c ω)²
    sprung = car.spring_rate_n_m - car.sprung_mass_kg * square
    unsprung = car.spring_rate_n_m + car.tyre_rate_n_m - car.unsprung_mass_kg * square
    damper = car.damping_n_s_m * omega
    real = sprung * unsprung - car.spring_rate_n_m**2  # the terms −(cω)² + (cω)² cancel
    imaginary = damper * (sprung + unsprung - 2.0 * car.spring_rate_n_m)
    stroke = car.sprung_mass_kg * car.tyre_rate_n_m * square / np.sqrt(real * real + imaginary * imaginary)
    return np.asarray(stroke * road(frequency_hz, on))


def road(frequency_hz: NDArray[np.float64], on: Road) -> NDArray[np.float64]:
    """Amplitude of the road's height, 1/sqrt(f² + f_c²); (K,), relative. Its velocity is white above the
    corner.
    """
    return np.asarray(1.0 / np.sqrt(frequency_hz * frequency_hz + on.corner_hz * on.corner_hz))


def control(frequency_hz: NDArray[np.float64], corner_hz: float) -> NDArray[np.float64]:
    """Amplitude of a control signal: flat to the corner, first order (1/f) beyond; (K,), relative.

    Witters & Swevers 2009, section 4.2, states the two pieces; they are taken as exact, with the corner between them.
    """
    return np.asarray(np.minimum(1.0, corner_hz / frequency_hz))


def table(
    frequency_hz: NDArray[np.float64], known_hz: tuple[float, ...], amplitude: tuple[float, ...]
) -> NDArray[np.float64]:
    """Amplitude from a table, linear between its points; (K,).

    Raises DesignError where the table does not span the lines, or leaves them all without power.
    """
    if frequency_hz[0] < known_hz[0] * (1 - 1e-9) or frequency_hz[-1] > known_hz[-1] * (1 + 1e-9):
        raise DesignError(
            f"frequency reaches from {known_hz[0]:g} to {known_hz[-1]:g} Hz: it must span the excited band, "
            f"{frequency_hz[0]:g} to {frequency_hz[-1]:g} Hz"
        )
    values = np.interp(frequency_hz, known_hz, amplitude)
    if not values.any():
        raise DesignError("amplitude is zero on every excited line: at least one must carry power")
    return np.asarray(values)
