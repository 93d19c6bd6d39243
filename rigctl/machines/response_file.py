"""Response and drive files of a console: channels by name, units converted, as captured samples."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.rpc3 import Channel, TimeHistory
from rigctl.errors import ForeignFileError
from rigctl.foreign_files.clock import read_clock
from rigctl.machines.roles import MEASURED, Role

UNITS: Final[Mapping[Role, Mapping[str, float]]] = {
    Role.POSITION: {"m": 1.0, "mm": 1e-3, "in": 0.0254},
    Role.FORCE: {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605},
    Role.CURRENT: {"A": 1.0, "mA": 1e-3},
    Role.TEMPERATURE: {"degC": 1.0, "°C": 1.0},
    Role.PRESSURE: {"Pa": 1.0, "bar": 1e5, "MPa": 1e6},
}


def rows_of(history: TimeHistory, names: Mapping[Role, str], rate_hz: float) -> NDArray[np.float64]:
    """Captured samples, (n, 5), of a response; channels without a name in the map are 0.

    Raises
    ------
    ExcitationFileError
        Where a channel is missing or in an unknown unit, or the rate is not that of the map.
    """
    if abs(history.sample_rate_hz - rate_hz) > 1e-6 * rate_hz:
        raise ExcitationFileError(f"its rate is {history.sample_rate_hz:g} Hz, the map says {rate_hz:g} Hz")
    found = {one.name: one for one in history.channels}
    rows = np.zeros((history.channels[0].values.size, len(MEASURED)))
    for role, name in names.items():
        if not name:
            continue
        if name not in found:
            raise ExcitationFileError(f"channel {name!r} is missing: there are {', '.join(found)}")
        factor = UNITS[role].get(found[name].unit)
        if factor is None:
            raise ExcitationFileError(f"channel {name!r} is in {found[name].unit!r}: use {', '.join(UNITS[role])}")
        rows[:, MEASURED.index(role)] = found[name].values * factor
    if not np.isfinite(rows).all():
        raise ExcitationFileError(f"sample {int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])} is not finite")
    return rows


def write_drive_csv(path: Path, channels: Sequence[Channel], rate_hz: float) -> None:
    """A drive file as text: one column "name [unit]" for each channel, after the time."""
    time = np.arange(channels[0].values.size) / rate_hz
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", *(f"{one.name} [{one.unit}]" for one in channels)])
        writer.writerows(zip(time.tolist(), *(one.values.tolist() for one in channels), strict=True))


def read_response_csv(path: Path) -> TimeHistory:
    """A response file as text, in the form of `write_drive_csv`; ExcitationFileError names the line."""
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    if len(lines) < 3:
        raise ExcitationFileError(f"{path}: {len(lines)} lines: a heading and at least two samples are needed")
    heads = [head.strip().removesuffix("]").split(" [") for head in lines[0]]
    if any(len(head) != 2 for head in heads):
        raise ExcitationFileError(f"{path}: line 1: each heading must be 'name [unit]'")
    values = np.empty((len(lines) - 1, len(heads)))
    for number, line in enumerate(lines[1:], start=2):
        try:
            values[number - 2] = [float(cell) for cell in line]
        except ValueError as error:
            raise ExcitationFileError(f"{path}: line {number}: {error}") from error
    try:
        rate_hz = read_clock(values[:, 0], lambda n: f"line {n + 2}").rate_hz
    except ForeignFileError as error:
        raise ExcitationFileError(f"{path}: the first column must be the time: {error}") from error
    channels = tuple(Channel(name=name, unit=unit, values=values[:, k]) for k, (name, unit) in enumerate(heads) if k)
    return TimeHistory(sample_rate_hz=round(rate_hz, 6), channels=channels, drive=False)
