"""Plan files out and in: TOML, CSV and HDF5, one row, table or group per test."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeVar

import h5py
import numpy as np

from excitation.atomic import written_whole
from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.hdf5 import FORMAT, get_excitation, put_excitation
from excitation.kinds import NOISE, Kind
from excitation.plan import Test, TestPlan, conditions_of, config_of, plan_from_config, test_of
from excitation.signal import JSON, Excitation
from excitation.spreadsheet import TIME
from excitation.synthesis import excitation_from_config, reads_a_file
from excitation.untrusted import DAMAGE, open_hdf5, parse_json

__all__ = ["PLAN_FORMAT", "holds_a_plan", "read_plan", "read_plan_config", "write_plan"]

Content = TypeVar("Content")

PLAN_FORMAT = "damper-rig/plan"
VERSION = 1

_COLUMNS: Mapping[str, str] = {  # the keys of a test and the heads of their columns
    "name": "name",
    "kind": "wave_form",
    "amplitude": "amplitude (m)",
    "frequency": "frequency (Hz)",
    "current": "current (A)",
    "cycles": "cycles",
    "settling_cycles": "settling_cycles",
    "min_temperature": "min_temperature (degC)",
    "max_temperature": "max_temperature (degC)",
    "dwell": "dwell (s)",
    "held_out": "held_out",
    "data_set": "data_set",
    "sample_rate": "sample_rate (Hz)",
}
_FURTHER = "further"  # what has no column of its own, as JSON


def write_plan(path: Path | str, plan: TestPlan) -> None:
    """Writes the plan whole or not at all; the ending, .toml, .csv or .h5, says the format."""
    path = Path(path)
    writers = {".toml": _write_toml, ".csv": _write_csv, ".h5": _write_hdf5}
    if path.suffix.lower() not in writers:
        raise ExcitationFileError(f"{path}: the ending {path.suffix!r} is not known: use {', '.join(writers)}")
    with written_whole(path, ExcitationFileError) as temporary:
        writers[path.suffix.lower()](temporary, plan)


def read_plan(path: Path | str) -> TestPlan:
    """Reads a plan (.toml, .csv, .h5).

    Raises ExcitationFileError or DesignError, one line that names the file and the place in it.
    """
    readers: Mapping[str, Callable[[Path], TestPlan]] = {
        ".toml": lambda path: plan_from_config(_toml_config(path)),
        ".csv": lambda path: plan_from_config(_csv_config(path)),
        ".h5": _read_hdf5,
    }
    return _read(Path(path), readers)


def read_plan_config(path: Path | str) -> dict[str, JSON]:
    """What stands in a plan file (.toml, .csv), as ``plan_from_config`` reads it; nothing is designed.

    Raises ExcitationFileError, one line that names the file and the place in it.
    """
    return _read(Path(path), {".toml": _toml_config, ".csv": _csv_config})


def _read(path: Path, readers: Mapping[str, Callable[[Path], Content]]) -> Content:
    if path.suffix.lower() not in readers:
        raise ExcitationFileError(f"{path}: the ending {path.suffix!r} is not known: use {', '.join(readers)}")
    if not path.is_file():
        raise ExcitationFileError(f"{path}: no such file: give a plan ({', '.join(readers)})")
    try:
        return readers[path.suffix.lower()](path)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error
    except OSError as error:
        reason = str(error).splitlines()[0] if str(error) else "unreadable"
        raise ExcitationFileError(f"{path}: cannot be read as {path.suffix}: {reason}") from error
    except UnicodeDecodeError as error:
        raise ExcitationFileError(f"{path}: byte {error.start} is not UTF-8 text: save it as UTF-8") from error
    except ExcitationError:
        raise
    except (*DAMAGE, csv.Error) as error:
        raise ExcitationFileError(f"{path}: damaged: {str(error).splitlines()[0]}") from error


def holds_a_plan(path: Path) -> bool:
    """Whether the file is laid out as a plan, rather than as one excitation; its content may still be
    wrong.
    """
    ending = path.suffix.lower()
    if ending == ".csv" and path.is_file():
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            return TIME not in [cell.strip('"') for cell in file.readline().rstrip("\n").split(",")]
    if ending == ".h5" and path.is_file():
        with suppress(*DAMAGE), open_hdf5(path, ExcitationFileError) as file:
            return bool(file.attrs.get("format") != FORMAT)
    return ending in (".toml", ".csv", ".h5")


def _config(plan: TestPlan) -> dict[str, JSON]:
    config: dict[str, JSON] = {"format": PLAN_FORMAT, "format_version": VERSION}
    if plan.warm_up is not None:
        config["warm_up"] = config_of(plan.warm_up)
    return {**config, "tests": [_remakable(test) for test in plan.tests]}


def _remakable(test: Test) -> dict[str, JSON]:
    if "kind" not in test.excitation.design:
        raise ExcitationFileError(f"test {test.name!r} has samples but no design: write the plan as .h5")
    return config_of(test)


def _write_toml(path: Path, plan: TestPlan) -> None:
    from excitation.toml_text import toml_text

    path.write_text(toml_text(_config(plan)), encoding="utf-8")


def _toml_config(path: Path) -> dict[str, JSON]:
    try:
        config = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ExcitationFileError(f"{path}: not valid TOML: {error}") from error
    except RecursionError as error:
        raise ExcitationFileError(f"{path}: tables or lists nested too deep: this is no plan") from error
    layout = config.pop("format", PLAN_FORMAT)
    version = config.pop("format_version", VERSION)
    if layout != PLAN_FORMAT or version != VERSION:
        raise ExcitationFileError(f"{path}: format is {layout!r} {version}: a plan has {PLAN_FORMAT!r} {VERSION}")
    return config


def _write_csv(path: Path, plan: TestPlan) -> None:
    """The warm-up, where there is one, is the row whose data_set is "warm-up"."""
    rows = [_remakable(test) for test in plan.tests]
    if plan.warm_up is not None:
        rows.insert(0, {**_remakable(plan.warm_up), "data_set": "warm-up"})
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*_COLUMNS.values(), _FURTHER])
        for row in rows:
            own = {k: v for k, v in row.items() if k in _COLUMNS and not isinstance(v, Mapping)}
            further = {k: v for k, v in row.items() if k not in own}
            cells = [_cell(own.get(key)) for key in _COLUMNS]
            out.writerow([*cells, json.dumps(further) if further else ""])


def _cell(value: JSON) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def _csv_config(path: Path) -> dict[str, JSON]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file)
        if _COLUMNS["name"] not in (reader.fieldnames or []) or _COLUMNS["kind"] not in (reader.fieldnames or []):
            raise ExcitationFileError(f"{path}: line 1 needs the columns name and wave_form: this is no plan")
        rows = [_row(path, line, row) for line, row in enumerate(reader, start=2)]
    warm_up = [row for row in rows if row.get("data_set") == "warm-up"]
    config: dict[str, JSON] = {"tests": [row for row in rows if row not in warm_up]}
    if warm_up:
        config["warm_up"] = warm_up[0]
    return config


def _row(path: Path, line: int, row: Mapping[str, str | None]) -> dict[str, JSON]:
    config: dict[str, JSON] = {}
    for key, column in {**_COLUMNS, _FURTHER: _FURTHER}.items():
        text = (row.get(column) or "").strip()
        if not text:
            continue
        if key in ("name", "kind", "data_set"):
            config[key] = text
            continue
        try:
            value: JSON = parse_json(text.lower() if key == "held_out" else text)
        except ValueError as error:
            raise ExcitationFileError(f"{path}: line {line}, {column} is {text!r}: not a number") from error
        config.update(value if key == _FURTHER and isinstance(value, dict) else {key: value})
    return config


def _write_hdf5(path: Path, plan: TestPlan) -> None:
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs["format"] = PLAN_FORMAT
        file.attrs["format_version"] = VERSION
        tests = file.create_group("tests")
        for n, test in enumerate(plan.tests):
            _put_test(tests.create_group(f"{n:04d}"), test)
        if plan.warm_up is not None:
            _put_test(file.create_group("warm_up"), plan.warm_up)


def _put_test(group: h5py.Group, test: Test) -> None:
    put_excitation(group, test.excitation)
    group.attrs["name"] = test.name
    group.attrs["conditions"] = json.dumps(conditions_of(test))


def _read_hdf5(path: Path) -> TestPlan:
    with open_hdf5(path, ExcitationFileError) as file:
        layout = file.attrs.get("format")
        if layout != PLAN_FORMAT or "tests" not in file:
            raise ExcitationFileError(f"{path}: format is {layout!r}: it must be {PLAN_FORMAT!r} or {FORMAT!r}")
        tests = tuple(_get_test(file["tests"][name], f"{path}: tests/{name}") for name in sorted(file["tests"]))
        warm_up = _get_test(file["warm_up"], f"{path}: warm_up") if "warm_up" in file else None
    return TestPlan(tests=tests, warm_up=warm_up)


def _get_test(group: h5py.Group, where: str) -> Test:
    conditions = parse_json(group.attrs.get("conditions", "{}"))
    return test_of(str(group.attrs.get("name", "")), _as_design(get_excitation(group, where)), conditions)


_QUICK: Final = (Kind.MULTISINE, Kind.SINE, Kind.TRIANGLE, Kind.STEPS, Kind.SWEEP, NOISE, Kind.ROAD)
"""Kinds whose samples are made again in about the time that reading them takes."""


def _as_design(read: Excitation) -> Excitation:
    """What was read, as its design where that makes the same bytes: a plan then keeps no samples."""
    design = read.design
    if design.get("kind") not in _QUICK or design.get("phases", "random") != "random" or reads_a_file(design):
        return read
    try:
        made = excitation_from_config(design)
    except ExcitationError:
        return read
    stated = (made.kind, made.sample_rate_hz, made.period_samples, made.samples)
    same = stated == (read.kind, read.sample_rate_hz, read.period_samples, read.samples)
    if not (same and np.array_equal(made.displacement_m, read.displacement_m)):
        return read
    current, stored = made.current_a, read.current_a
    same = current is stored if current is None or stored is None else np.array_equal(current, stored)
    return made.with_figures(read.figures) if same else read
