"""What the procedures before a test leave behind for the run file: tare, warm-up, and the mass at the load cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from math import isfinite
from typing import Any, ClassVar, TypeVar

from excitation.configuration import to_spec
from excitation.errors import DesignError
from rigctl.errors import ProcedureError

__all__ = ["Mass", "Tare", "WarmUp", "record_from"]

_EXACT: dict[str, Any] = {"extra": "forbid", "allow_inf_nan": False}  # keys as the fields. Any: pydantic's own


@dataclass(frozen=True, slots=True, kw_only=True)
class Tare:
    """Reading of the load cell without load: the mean over a window at rest, and its standard uncertainty."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _EXACT

    rig: str  # vendor, model and serial number of the rig
    measured_at: str  # ISO 8601, UTC
    offset_n: float
    standard_deviation_n: float  # of one reading
    uncertainty_n: float  # of the mean: noise with its autocorrelation, and resolution
    readings: int
    window_s: float
    limit_n: float  # a larger offset would have been refused
    displacement_m: float
    temperature_degc: float

    def __post_init__(self) -> None:
        _check_time("tare", self.measured_at)
        if not (isfinite(self.offset_n) and 0 <= self.uncertainty_n < float("inf") and self.readings > 0):
            raise ProcedureError(
                f"tare: offset {self.offset_n} N ± {self.uncertainty_n} N of {self.readings} readings: "
                "it must be a finite mean of at least one reading"
            )

    def __str__(self) -> str:
        return f"tare of {self.offset_n:.2f} N ± {self.uncertainty_n:.2g} N at {self.measured_at}"


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """A finished warm-up: the work that the damper has taken up, and its temperature before and after."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _EXACT

    finished_at: str  # ISO 8601, UTC
    energy_j: float  # ∫ F dx over the samples that were played
    duration_s: float
    plays: int  # of the plan's warm-up
    start_degc: float
    end_degc: float

    def __post_init__(self) -> None:
        _check_time("warm-up", self.finished_at)

    def __str__(self) -> str:
        return (
            f"warm-up of {self.energy_j:.0f} J in {self.duration_s:.0f} s, "
            f"{self.start_degc:.1f} → {self.end_degc:.1f} °C, finished at {self.finished_at}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Mass:
    """Mass between load cell and specimen: measured force = force of the specimen + mass · acceleration.

    Displacement and force have the signs of the run file. The mass is positive where the load cell moves with the
    piston, and negative where the reading contains less than the specimen's force.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _EXACT

    rig: str
    measured_at: str
    mass_kg: float
    uncertainty_kg: float
    stiffness_n_m: float  # found at the same time: 0 within its uncertainty where nothing is attached
    stiffness_uncertainty_n_m: float
    from_hz: float
    to_hz: float
    run: str

    def __post_init__(self) -> None:
        _check_time("mass", self.measured_at)
        if not (isfinite(self.mass_kg) and 0 <= self.uncertainty_kg < float("inf")):
            raise ProcedureError(f"mass: {self.mass_kg} kg ± {self.uncertainty_kg} kg: both must be finite")

    def __str__(self) -> str:
        return (
            f"mass of {self.mass_kg:.4g} kg ± {2 * self.uncertainty_kg:.2g} kg (k = 2) "
            f"from {self.from_hz:.3g} … {self.to_hz:.3g} Hz at {self.measured_at}"
        )


def _check_time(what: str, text: str) -> None:
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        when = None
    if when is None or when.tzinfo is None:
        raise ProcedureError(f"{what}: the time is {text!r}: it must be a date and time with its zone, ISO 8601")


_Record = TypeVar("_Record", Tare, WarmUp, Mass)


def record_from(kind: type[_Record], content: object, where: str) -> _Record:
    """Read a record from what ``asdict`` made of it; ProcedureError, one line, otherwise."""
    if not isinstance(content, Mapping):
        raise ProcedureError(f"{where}: it must be a table of keys and values")
    try:
        return to_spec(kind, content, where)
    except DesignError as error:
        raise ProcedureError(str(error)) from error


def as_json(record: Tare | WarmUp | Mass) -> dict[str, Any]:
    """The record as a JSON object. Any: numbers and texts."""
    return asdict(record)
