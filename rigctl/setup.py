"""What is in the rig and how it was prepared; travels in the run file as optional attributes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.untrusted import parse_json
from rigctl.calibration import Calibration, calibration_from, calibrations_from
from rigctl.errors import CalibrationError, ProcedureError, RunFileError
from rigctl.interlocks import CHANNELS
from rigctl.preparation import Mass, Tare, WarmUp, as_json, record_from

__all__ = ["Setup", "get_setup", "put_setup", "setup_from_json", "setup_json"]

Record = TypeVar("Record", Tare, WarmUp, Mass)
TEXTS = ("specimen_serial", "fixture", "oil")


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Specimen, fixture, oil and ambient temperature; calibration records, tare and warm-up.

    ``notes`` become events at the beginning of the run.
    """

    specimen_serial: str = ""
    fixture: str = ""
    oil: str = ""
    ambient_degc: float | None = None
    calibrations: tuple[Calibration, ...] = ()
    tare: Tare | None = None
    warm_up: WarmUp | None = None
    compensated: Mass | None = None  # its inertia has been removed from the force
    notes: tuple[str, ...] = ()

    def corrected(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Captured samples, (n, 5) or more, with calibrations and tare applied to the first five channels.

        Channel: scale · reading + offset. Force with a tare: scale · (reading − tare), because the tare measures
        the offset.
        """
        if not self.calibrations and self.tare is None:
            return values
        scale, offset = np.ones(len(CHANNELS)), np.zeros(len(CHANNELS))
        for one in self.calibrations:
            k = CHANNELS.index(one.channel)
            scale[k], offset[k] = one.scale, one.offset
        if self.tare is not None:
            offset[0] = -scale[0] * self.tare.offset_n
        known = len(CHANNELS)
        return np.hstack([scale * values[:, :known] + offset, values[:, known:]])


def setup_json(setup: Setup) -> dict[str, Any]:
    """The setup as a JSON object, without what is empty and without its notes. Any: JSON."""
    whole = asdict(setup)
    return {key: value for key, value in whole.items() if value not in ("", None, ()) and key != "notes"}


def setup_from_json(content: Mapping[str, Any]) -> Setup:
    """Read what ``setup_json`` made; CalibrationError, ProcedureError, ValueError or TypeError otherwise. Any: JSON."""
    ambient = content.get("ambient_degc")
    return Setup(
        specimen_serial=str(content.get("specimen_serial", "")),
        fixture=str(content.get("fixture", "")),
        oil=str(content.get("oil", "")),
        ambient_degc=None if ambient is None else float(ambient),
        calibrations=calibrations_from(content.get("calibrations", ())),
        tare=_optional(Tare, content.get("tare"), "tare"),
        warm_up=_optional(WarmUp, content.get("warm_up"), "warm_up"),
        compensated=_optional(Mass, content.get("compensated"), "mass"),
    )


def _optional(kind: type[Record], content: object, where: str) -> Record | None:
    return None if content is None else record_from(kind, content, where)


def put_setup(file: h5py.File, setup: Setup) -> None:
    """Write it as attributes of the file and of its channels, which must exist."""
    for name in TEXTS:
        if text := getattr(setup, name):
            file.attrs[name] = text
    if setup.ambient_degc is not None:
        file.attrs["ambient_temperature"] = setup.ambient_degc
    for key, record in (("tare", setup.tare), ("warm_up", setup.warm_up), ("inertia_compensation", setup.compensated)):
        if record is not None:
            file.attrs[key] = json.dumps(as_json(record))
    for one in setup.calibrations:
        if one.channel in file["channels"]:
            attributes = file["channels"][one.channel].attrs
            for key, value in asdict(one).items():
                if key != "channel" and value != "":
                    attributes[f"calibration_{key}"] = value


def get_setup(file: h5py.File) -> Setup:
    """Read it back; RunFileError where an attribute of these names is damaged."""
    try:
        ambient = file.attrs.get("ambient_temperature")
        return Setup(
            specimen_serial=_plain(file.attrs.get("specimen_serial", "")),
            fixture=_plain(file.attrs.get("fixture", "")),
            oil=_plain(file.attrs.get("oil", "")),
            ambient_degc=None if ambient is None else float(np.asarray(ambient).reshape(-1)[0]),
            calibrations=tuple(_calibrations(file)),
            compensated=_optional(Mass, _record(file, "inertia_compensation"), "inertia_compensation"),
            tare=_optional(Tare, _record(file, "tare"), "tare"),
            warm_up=_optional(WarmUp, _record(file, "warm_up"), "warm_up"),
        )
    except (CalibrationError, ProcedureError, ValueError, TypeError, IndexError) as error:
        raise RunFileError(f"attributes of the preparation: {' '.join(str(error).split())[:160]}") from error


def _record(file: h5py.File, key: str) -> object:
    text = file.attrs.get(key)
    return None if text is None else parse_json(_plain(text))


def _calibrations(file: h5py.File) -> list[Calibration]:
    found = []
    for name in CHANNELS:
        channel = file["channels"].get(name)
        if channel is None or "calibration_serial" not in channel.attrs:
            continue
        keys = (one.name for one in fields(Calibration) if f"calibration_{one.name}" in channel.attrs)
        own = {key: _value(channel.attrs[f"calibration_{key}"]) for key in keys}
        found.append(calibration_from({"channel": name, **own}, f"calibration of {name}"))
    return found


def _value(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else _plain(value)


def _plain(value: object) -> str:
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)
