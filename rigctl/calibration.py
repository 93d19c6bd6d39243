"""Calibration records of the sensors: serial number, date, expiry, correction and uncertainty."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date as Day  # "date" is also the name of a field
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar

from excitation.configuration import STRICT, to_spec
from excitation.errors import DesignError
from excitation.untrusted import parse_json
from rigctl.errors import CalibrationError, CalibrationExpired
from rigctl.interlocks import CHANNELS

__all__ = ["FORMAT", "Calibration", "calibration_from", "calibrations_from", "check_valid", "read_calibrations"]

FORMAT = "damper-rig/calibration"
VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """One sensor's certificate: true value = scale · reading + offset, with a standard uncertainty.

    ``reading`` is what the rig reports, in SI. Sensor, serial number and date are as on the certificate; it is valid
    up to and including the day ``expires``.

    Raises CalibrationError: one line.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT  # Any: pydantic's own dictionary

    channel: str
    serial: str
    date: str  # ISO 8601
    expires: str
    sensor: str = ""  # make and model
    scale: float = 1.0
    offset: float = 0.0  # in the unit of the channel
    uncertainty: float = 0.0  # standard uncertainty of the corrected value, in the unit of the channel
    certificate: str = ""  # its number

    def __post_init__(self) -> None:
        if self.channel not in CHANNELS:
            raise CalibrationError(
                f"calibration: channel {self.channel!r} does not exist: choose one of {', '.join(CHANNELS)}"
            )
        if not self.serial.strip():
            raise CalibrationError(f"calibration of {self.channel}: serial is empty: give the sensor's serial number")
        if _day(self, "date") > _day(self, "expires"):
            raise CalibrationError(
                f"calibration of {self.channel}: it expires on {self.expires}, before its date {self.date}"
            )
        if not (isfinite(self.scale) and self.scale != 0 and isfinite(self.offset)):
            raise CalibrationError(
                f"calibration of {self.channel}: scale is {self.scale} and offset {self.offset}: "
                "both must be finite and the scale not 0"
            )
        if not 0 <= self.uncertainty < float("inf"):
            raise CalibrationError(f"calibration of {self.channel}: uncertainty is {self.uncertainty}: it must be >= 0")

    def __str__(self) -> str:
        return f"calibration of {self.channel} ({self.sensor or 'sensor'}, serial {self.serial})"

    def expired(self, today: Day) -> bool:
        return today > _day(self, "expires")


def _day(calibration: Calibration, key: str) -> Day:
    text = getattr(calibration, key)
    try:
        return Day.fromisoformat(text)
    except ValueError:
        raise CalibrationError(
            f"calibration of {calibration.channel}: {key} is {text!r}: it must be a day such as 2026-03-31"
        ) from None


def read_calibrations(path: Path) -> tuple[Calibration, ...]:
    """Read a file of calibration records (.toml, .json), one table in ``sensors`` for each channel.

    Raises CalibrationError: one line that names the file.
    """
    try:
        return _read(path)
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None


def _read(path: Path) -> tuple[Calibration, ...]:
    config = _table(path)
    if (found := config.get("format", FORMAT)) != FORMAT or config.get("format_version", VERSION) != VERSION:
        raise CalibrationError(f"format is {found!r} {config.get('format_version')}: it must be {FORMAT!r} {VERSION}")
    sensors = config.get("sensors")
    if not isinstance(sensors, Sequence) or isinstance(sensors, str) or not sensors:
        raise CalibrationError("sensors is missing: give one table [[sensors]] for each channel")
    return calibrations_from(sensors)


def calibrations_from(entries: Sequence[object]) -> tuple[Calibration, ...]:
    """The records that tables describe, one for each channel; CalibrationError, one line, otherwise."""
    found = tuple(calibration_from(entry, f"sensors[{k}]") for k, entry in enumerate(entries))
    twice = [name for name, count in Counter(one.channel for one in found).items() if count > 1]
    if twice:
        raise CalibrationError(f"channel {twice[0]!r} occurs more than once: one sensor measures one channel")
    return found


def _table(path: Path) -> dict[str, Any]:
    """The file's content. Any: TOML or JSON from outside, checked afterwards."""
    try:
        text = path.read_text(encoding="utf-8")
        content = parse_json(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise CalibrationError(f"cannot be read ({error.strerror or error})") from error
    except ValueError as error:
        raise CalibrationError(f"neither valid TOML nor JSON ({' '.join(str(error).split())[:120]})") from error
    if not isinstance(content, dict):
        raise CalibrationError("it must be a table with the key sensors")
    return content


def calibration_from(entry: object, where: str) -> Calibration:
    """The record that a table describes; CalibrationError otherwise."""
    if not isinstance(entry, Mapping):
        raise CalibrationError(f"{where} is {entry!r:.60}: it must be a table of keys and values")
    plain = {key: value.isoformat() if isinstance(value, Day) else value for key, value in entry.items()}
    try:
        return to_spec(Calibration, plain, where)
    except DesignError as error:
        raise CalibrationError(str(error)) from error


def check_valid(calibrations: Sequence[Calibration], today: Day) -> None:
    """Raise CalibrationExpired, one line, where a record has expired or is dated in the future."""
    late = [one for one in calibrations if one.expired(today)]
    if late:
        names = "; ".join(f"{one} expired on {one.expires}" for one in late)
        raise CalibrationExpired(f"{names}: calibrate again, or accept it for this run")
    for one in calibrations:
        if Day.fromisoformat(one.date) > today:
            raise CalibrationError(f"{one} is dated {one.date}, after today ({today.isoformat()}): check the clock")
