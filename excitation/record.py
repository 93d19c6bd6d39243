"""One channel of a measured record, from a run file, an RPC III file, a MAT file or a CSV, in SI units."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.matlab import read_variables
from excitation.rpc3 import plain_unit, read_rpc3
from excitation.spreadsheet import TIME, check_last_line, check_samples, measured_rate, read_description
from excitation.untrusted import DAMAGE, open_hdf5

__all__ = ["RECORDS", "UNITS", "read_channel"]

UNITS: Final[Mapping[str, tuple[str, float]]] = {
    "m": ("m", 1.0), "mm": ("m", 1e-3), "cm": ("m", 1e-2), "um": ("m", 1e-6), "in": ("m", 0.0254),
    "A": ("A", 1.0), "mA": ("A", 1e-3), "amp": ("A", 1.0),
}  # fmt: skip
"""What each unit of a record measures, and its factor to SI."""

_LEAST_SAMPLES: Final = 64

Read = tuple[NDArray[np.float64], float, str]  # values, sample rate, unit as the file says it ("" where it does not)


def read_channel(path: Path, channel: str, si: str, unit: str = "") -> tuple[NDArray[np.float64], float]:
    """The channel in the SI unit ``si``, (N,), and its sample rate, Hz.

    ``unit`` is used where the file states none. Raises DesignError: the file, the channel, and what is wrong.
    """
    reader = RECORDS.get(path.suffix.lower())
    if reader is None:
        raise DesignError(f"record {path}: the ending {path.suffix!r} is not known: use {', '.join(RECORDS)}")
    if not path.is_file():
        raise DesignError(f"record {path}: no such file: give a record that can be read")
    try:
        values, rate_hz, stated = reader(path, channel)
    except DesignError:
        raise
    except ExcitationError as error:
        raise DesignError(f"record {error}") from error
    except (OSError, UnicodeDecodeError, ValueError, TypeError, csv.Error, *DAMAGE) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DesignError(f"record {path}: cannot be read: {reason:.200}") from error
    measured, factor = UNITS.get(plain_unit(stated or unit), ("", 0.0))
    if measured != si:
        known = ", ".join(name for name, (of, _) in UNITS.items() if of == si)
        raise DesignError(f"record {path}: channel {channel!r} has unit {stated or unit!r}: it must be one of {known}")
    values = factor * np.asarray(values, dtype=np.float64).reshape(-1)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size or values.size < _LEAST_SAMPLES:
        what = f"sample {bad[0]} is {values[bad[0]]}" if bad.size else f"it has {values.size} samples"
        raise DesignError(f"record {path}: channel {channel!r}: {what}: give {_LEAST_SAMPLES} or more finite samples")
    if not 0.0 < rate_hz < float("inf"):
        raise DesignError(f"record {path}: its sample rate is {rate_hz:g} Hz: it must be above 0")
    return values, rate_hz


def _missing(path: Path, channel: str, known: list[str]) -> DesignError:
    return DesignError(f"record {path}: there is no channel {channel!r}: it has {', '.join(known) or 'none'}")


def _of_run(path: Path, channel: str) -> Read:
    with open_hdf5(path, DesignError) as file:
        channels = file.get("channels", {})
        if channel not in channels:
            raise _missing(path, channel, list(channels))
        data = channels[channel]
        return np.asarray(data[()]), float(file.attrs.get("sample_rate", 0.0)), str(data.attrs.get("unit", ""))


def _of_rpc3(path: Path, channel: str) -> Read:
    history = read_rpc3(path)
    found = next((one for one in history.channels if one.name == channel), None)
    if found is None:
        raise _missing(path, channel, [one.name for one in history.channels])
    return found.values, history.sample_rate_hz, found.unit


def _of_mat(path: Path, channel: str) -> Read:
    """A vector named like the channel, beside `sample_rate` (Hz) or `time` (s)."""
    found = read_variables(path)
    own = [name for name in found if not name.startswith("__")]
    if channel not in own:
        raise _missing(path, channel, own)
    if "sample_rate" in found:
        rate_hz = float(found["sample_rate"])
    elif "time" in found:
        rate_hz = measured_rate(path, np.asarray(found["time"], dtype=np.float64).reshape(-1))
    else:
        raise DesignError(f"record {path}: it has neither sample_rate nor time: add one of them")
    own_unit = _OWN_UNITS.get(channel, "") if "excitation_kind" in found else ""
    return np.asarray(found[channel]), rate_hz, own_unit


_OWN_UNITS: Final[Mapping[str, str]] = {"displacement_command": "m", "current_command": "A"}
"""Of the variables of a MAT file of this program, which states none."""


def _of_csv(path: Path, channel: str) -> Read:
    """Columns `time (s)` and `CHANNEL (unit)`."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.reader(file)
        header = [cell.strip() for cell in next(rows, [])]
        first = next(rows, [])
    units = {name.strip(): unit.rstrip(")").strip() for name, _, unit in (cell.partition("(") for cell in header)}
    names = [cell.partition("(")[0].strip() for cell in header]
    if TIME not in header or channel not in names:
        raise _missing(path, channel if TIME in header else TIME, header)
    if not first:
        raise ExcitationFileError(f"{path}: no samples: a record has {_LEAST_SAMPLES} or more")
    check_last_line(path, header)
    times, values = _columns(path, (header.index(TIME), names.index(channel)))
    check_samples(path, read_description(path, first, header), values.size)
    return values, measured_rate(path, times), units[channel]


def _columns(path: Path, columns: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two columns below the header, (N,) each; row by row only where a cell is no number, to find its line."""
    try:
        both = np.loadtxt(
            path,
            delimiter=",",
            quotechar='"',
            comments=None,
            skiprows=1,
            usecols=columns,
            encoding="utf-8-sig",
            ndmin=2,
        )
        return both[:, 0], both[:, 1]
    except ValueError:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = [row for row in csv.reader(file) if row][1:]
        first, second = (np.array(_column(path, table, column)) for column in columns)
        return first, second


def _column(path: Path, table: list[list[str]], column: int) -> list[float]:
    values = []
    for line, row in enumerate(table, start=2):
        try:
            values.append(float(row[column]))
        except (ValueError, IndexError) as error:
            raise ExcitationFileError(f"{path}: line {line}, column {column + 1}: it must be a number") from error
    if len(values) < 2:
        raise ExcitationFileError(f"{path}: {len(values)} samples: a record has {_LEAST_SAMPLES} or more")
    return values


RECORDS: Final[Mapping[str, Callable[[Path, str], Read]]] = {
    ".h5": _of_run, ".csv": _of_csv, ".mat": _of_mat, ".drv": _of_rpc3, ".rsp": _of_rpc3, ".rpc": _of_rpc3,
}  # fmt: skip
"""The reader of each ending."""
