"""Runs in the formats of other programs: CSV for spreadsheets, MAT for MATLAB."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, repeat
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from api.errors import InputError, one_line
from excitation.atomic import written_whole
from excitation.untrusted import check_mat, parse_json
from rigctl.errors import ForeignFileError, ProcedureError, RunFileError
from rigctl.foreign_files.clock import read_clock
from rigctl.runfile import UNIT_SPELLINGS, Run, read_run, write_run
from rigctl.setup import setup_from_json, setup_json

__all__ = ["ENDINGS", "read_any", "write_any"]

Handler = TypeVar("Handler")

_NEEDED = ("run_id", "created", "excitation_kind", "status", "sample_rate", "period_samples")
_TEXTS = (
    *("run_id", "created", "specimen", "excitation_kind", "status"),
    *("test_id", "campaign_id", "rig", "operator", "software_version"),
)
_TIME = "time (s)"
_EXTRA = ["property", "value"]
_OTHERS = (
    f"a run that 'damper-rig convert' wrote has the columns {_TIME!r}, the channels, 'property' and 'value'; "
    "'damper-rig import' reads the files of other programs"
)


def read_any(path: Path) -> Run:
    """The run in a .h5, .csv or .mat file.

    Raises InputError or RunFileError: one line that names the file and the place in it.
    """
    reader = _by_ending(path, {".h5": read_run, ".csv": _read_csv, ".mat": _read_mat})
    if not path.is_file():
        raise InputError(f"{path}: no such file: give a run ({', '.join(ENDINGS)})")
    try:
        return replace(reader(path), path=path)
    except RunFileError as error:
        text = str(error)
        raise RunFileError(text if text.startswith(str(path)) else f"{path}: {text}") from error


def write_any(path: Path, run: Run) -> None:
    """Write a run whole or not at all; the ending, .h5, .csv or .mat, sets the format."""
    writer = _by_ending(path, {".h5": write_run, ".csv": _write_csv, ".mat": _write_mat})
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist: make it first")
    writer(path, run)


ENDINGS = (".h5", ".csv", ".mat")


def _by_ending(path: Path, known: Mapping[str, Handler]) -> Handler:
    handler = known.get(path.suffix.lower())
    if handler is None:
        raise InputError(f"{path}: the ending {path.suffix!r} is not known: use {', '.join(known)}")
    return handler


def _properties(run: Run) -> dict[str, str]:
    texts = {name: getattr(run, name) for name in _TEXTS if getattr(run, name)}
    numbers = {"sample_rate": repr(run.sample_rate_hz), "period_samples": str(run.period_samples)}
    more = {"design": json.dumps(dict(run.design))} if run.design is not None else {}
    events = {"events": json.dumps(run.events)} if run.events else {}
    stamps = {"events_utc": json.dumps(run.events_utc)} if run.events_utc else {}
    setup = {"setup": json.dumps(prepared)} if (prepared := setup_json(run.setup)) else {}
    return {**numbers, **texts, **more, **events, **stamps, **setup}


def _run(properties: Mapping[str, str], channels: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]) -> Run:
    """The run of its properties as text; raises InputError for one that is missing or cannot be read."""
    lacking = [name for name in _NEEDED if name not in properties]
    if lacking:
        raise InputError(f"property {lacking[0]!r} is missing: a run cannot be made without it")
    try:
        design = properties.get("design")
        return Run(
            run_id=properties["run_id"],
            created=properties["created"],
            specimen=properties.get("specimen", ""),
            sample_rate_hz=float(properties["sample_rate"]),
            period_samples=int(properties["period_samples"]),
            excitation_kind=properties["excitation_kind"],
            status=properties["status"],
            channels=channels,
            units=units,
            design=None if design is None else parse_json(design),
            events=tuple((float(at), str(text)) for at, text in parse_json(properties.get("events", "[]"))),
            events_utc=tuple(str(stamp) for stamp in parse_json(properties.get("events_utc", "[]"))),
            setup=setup_from_json(parse_json(properties.get("setup", "{}"))),
            test_id=properties.get("test_id", ""),
            campaign_id=properties.get("campaign_id", ""),
            rig=properties.get("rig", ""),
            operator=properties.get("operator", ""),
            software_version=properties.get("software_version", ""),
        )
    except RunFileError:
        raise
    except (ValueError, TypeError, AttributeError, ProcedureError) as error:
        raise InputError(f"a property cannot be read: {one_line(error)}") from error


def _write_csv(path: Path, run: Run) -> None:
    """A column for each channel; the last two columns hold the properties of the run."""
    names = list(run.channels)
    columns = [run.channels[name].tolist() for name in names]
    with written_whole(path, RunFileError) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([_TIME, *(f"{name} ({run.units[name]})" for name in names), *_EXTRA])
        more = chain(_properties(run).items(), repeat(("", "")))
        for n, row in enumerate(zip(*columns, strict=True)):
            out.writerow([n / run.sample_rate_hz, *row, *next(more)])


def _read_csv(path: Path) -> Run:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = csv.reader(file)
            header = next(rows, [])
            table = [row for row in rows if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV file in UTF-8: {_OTHERS}") from error
    if header[-2:] != _EXTRA or header[:1] != [_TIME]:
        raise InputError(f"{path}: line 1: {_OTHERS}")
    for line, row in enumerate(table, start=2):
        if len(row) != len(header):
            raise InputError(f"{path}: line {line} has {len(row)} fields: it must have {len(header)}")
    heads = [_channel_head(path, head) for head in header[1:-2]]
    doubled = [name for name, count in Counter(name for name, _ in heads).items() if count > 1]
    if doubled:
        raise InputError(f"{path}: line 1: channel {doubled[0]!r} stands twice: leave one of its columns out")
    channels = {name: _numbers(path, table, k, name) for k, (name, _) in enumerate(heads, start=1)}
    properties = {row[-2]: row[-1] for row in table if row[-2]}
    try:
        run = _run(properties, channels, dict(heads))
        if run.samples > 1:
            read_clock(_numbers(path, table, 0, _TIME), lambda n: f"line {n + 2}", run.sample_rate_hz)
    except (InputError, ForeignFileError) as error:
        raise InputError(f"{path}: {error}") from error
    return run


def _channel_head(path: Path, head: str) -> tuple[str, str]:
    name, _, rest = head.partition(" (")
    if not name or not rest.endswith(")"):
        raise InputError(f"{path}: line 1: column {head!r}: a channel is written as name (unit)")
    return name, UNIT_SPELLINGS.get(rest[:-1], rest[:-1])


def _numbers(path: Path, table: Sequence[Sequence[str]], column: int, name: str) -> NDArray[np.float64]:
    values = []
    for line, row in enumerate(table, start=2):
        try:
            values.append(float(row[column]))
        except ValueError as error:
            raise InputError(f"{path}: line {line}, channel {name} is {row[column]!r}: it must be a number") from error
    return np.array(values, dtype=np.float64)


def _write_mat(path: Path, run: Run) -> None:
    """A struct ``run``: fields channels, units and properties, each a struct; samples are columns."""
    from scipy.io import savemat

    content = {
        "channels": {name: values[:, np.newaxis] for name, values in run.channels.items()},
        "units": dict(run.units),
        "properties": _properties(run),
    }
    try:
        with written_whole(path, RunFileError) as temporary:
            savemat(temporary, {"run": content}, appendmat=False, do_compression=True, long_field_names=True)
    except ValueError as error:
        raise InputError(f"{path}: this run does not fit into a MAT file: {one_line(error)}") from error


def _read_mat(path: Path) -> Run:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    check_mat(path)
    try:
        content = loadmat(path, simplify_cells=True, chars_as_strings=True)
    except (MatReadError, OSError, ValueError, TypeError, NotImplementedError, IndexError, EOFError) as error:
        raise InputError(f"{path}: not a MAT file of version 7 or earlier: {one_line(error)}") from error
    found = content.get("run")
    parts = ("channels", "units", "properties")
    if not isinstance(found, dict) or not all(isinstance(found.get(part), dict) for part in parts):
        raise InputError(f"{path}: has no struct 'run' with the fields channels, units and properties")
    channels = {name: _column(path, name, values) for name, values in found["channels"].items()}
    units = {name: UNIT_SPELLINGS.get(str(unit), str(unit)) for name, unit in found["units"].items()}
    properties = {name: str(value) for name, value in found["properties"].items()}
    try:
        return _run(properties, channels, units)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _column(path: Path, name: str, values: Any) -> NDArray[np.float64]:
    # Any: a MAT file may hold anything
    try:
        return np.asarray(values, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: channel {name}: not a column of numbers") from error
