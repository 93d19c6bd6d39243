"""Plan files out and in: TOML, CSV and HDF5, one row, table or group per test."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from excitation.atomic import written_whole
from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.hdf5 import FORMAT
from excitation.plan import MakeExcitation, Test, TestPlan, config_of, plan_from_config
from excitation.plan_hdf5 import PLAN_FORMAT, read_plan_hdf5, write_plan_hdf5
from excitation.record_path import resolved, written_beside
from excitation.signal import JSON
from excitation.spreadsheet import TIME, check_last_line
from excitation.synthesis import excitation_from_config
from excitation.untrusted import DAMAGE, open_hdf5, parse_json

__all__ = ["PLAN_FORMAT", "VERSION", "holds_a_plan", "located", "read_plan", "read_plan_config", "write_plan"]

Content = TypeVar("Content")

VERSION = 1  # of plans as text

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
_ROWS = "rows"  # in the first row: how many there are; a file that was cut off between two lines has fewer


def write_plan(path: Path | str, plan: TestPlan, *, whole: bool = False) -> None:
    """Writes the plan whole or not at all; the ending, .toml, .csv or .h5, says the format.

    Designs are written, and samples, in .h5 alone, of tests that no design makes again: up to 5 MB of them. Records
    that are replayed are named by a path that counts from the plan, and their SHA-256; with ``whole``, in .h5, all
    samples of records are written, and any number of others.
    """
    path = Path(path)
    writers: Mapping[str, Callable[[Path], None]] = {
        ".toml": lambda to: _write_toml(to, _config(plan, path.parent)),
        ".csv": lambda to: _write_csv(to, _config(plan, path.parent)),
        ".h5": lambda to: write_plan_hdf5(to, plan, folder=path.parent, whole=whole),
    }
    if path.suffix.lower() not in writers:
        raise ExcitationFileError(f"{path}: the ending {path.suffix!r} is not known: use {', '.join(writers)}")
    with written_whole(path, ExcitationFileError) as temporary:
        writers[path.suffix.lower()](temporary)


def read_plan(path: Path | str, make: MakeExcitation = excitation_from_config) -> TestPlan:
    """Reads a plan (.toml, .csv, .h5); ``make`` makes the excitations of designs.

    Raises ExcitationFileError or DesignError, one line that names the file and the place in it.
    """
    readers: Mapping[str, Callable[[Path], TestPlan]] = {
        ".toml": lambda path: plan_from_config(located(_toml_config(path), path.parent), make),
        ".csv": lambda path: plan_from_config(located(_csv_config(path), path.parent), make),
        ".h5": lambda path: read_plan_hdf5(path, make),
    }
    return _read(Path(path), readers)


def located(config: Mapping[str, JSON], folder: Path) -> dict[str, JSON]:
    """The plan with the records of its tests found from ``folder``; what is no plan is refused where it is read."""
    found = dict(config)
    if isinstance(tests := config.get("tests"), (list, tuple)):
        found["tests"] = [resolved(test, folder) if isinstance(test, Mapping) else test for test in tests]
    if isinstance(warm_up := config.get("warm_up"), Mapping):
        found["warm_up"] = resolved(warm_up, folder)
    return found


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


def _config(plan: TestPlan, folder: Path) -> dict[str, JSON]:
    config: dict[str, JSON] = {"format": PLAN_FORMAT, "format_version": VERSION}
    if plan.warm_up is not None:
        config["warm_up"] = _remakable(plan.warm_up, folder)
    return {**config, "tests": [_remakable(test, folder) for test in plan.tests]}


def _remakable(test: Test, folder: Path) -> dict[str, JSON]:
    if "kind" not in test.excitation.design:
        raise ExcitationFileError(f"test {test.name!r} has samples but no design: write the plan as .h5")
    return written_beside(config_of(test), folder)


def _write_toml(path: Path, config: Mapping[str, JSON]) -> None:
    from excitation.toml_text import toml_text

    path.write_text(toml_text(config), encoding="utf-8")


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


def _write_csv(path: Path, config: Mapping[str, Any]) -> None:
    """The warm-up, where there is one, is the row whose data_set is "warm-up". Any: JSON."""
    rows = list(config["tests"])
    if "warm_up" in config:
        rows.insert(0, {**config["warm_up"], "data_set": "warm-up"})
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*_COLUMNS.values(), _ROWS, _FURTHER])
        for n, row in enumerate(rows):
            own = {k: v for k, v in row.items() if k in _COLUMNS and not isinstance(v, Mapping)}
            further = {k: v for k, v in row.items() if k not in own}
            cells = [_cell(own.get(key)) for key in _COLUMNS]
            out.writerow([*cells, "" if n else len(rows), json.dumps(further) if further else ""])


def _cell(value: JSON) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def _csv_config(path: Path) -> dict[str, JSON]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file)
        if _COLUMNS["name"] not in (reader.fieldnames or []) or _COLUMNS["kind"] not in (reader.fieldnames or []):
            raise ExcitationFileError(f"{path}: line 1 needs the columns name and wave_form: this is no plan")
        table = list(reader)
    _check_rows(path, table, reader.fieldnames or [])
    rows = [_row(path, line, row) for line, row in enumerate(table, start=2)]
    warm_up = [row for row in rows if row.get("data_set") == "warm-up"]
    config: dict[str, JSON] = {"tests": [row for row in rows if row not in warm_up]}
    if warm_up:
        config["warm_up"] = warm_up[0]
    return config


def _check_rows(path: Path, table: list[dict[str, str]], header: Sequence[str]) -> None:
    """Raises ExcitationFileError where the first row states another number of rows: the file was cut off."""
    if not table:
        raise ExcitationFileError(f"{path}: nothing below line 1: a plan has one or more tests")
    check_last_line(path, header)
    stated = (table[0].get(_ROWS) or "").strip()
    if stated and not path.read_bytes().endswith((b"\n", b"\r")):
        raise ExcitationFileError(f"{path}: the last line has no end: the file is cut off there, or add a line break")
    if stated and stated != str(len(table)):
        raise ExcitationFileError(
            f"{path}: {len(table)} rows: line 2, {_ROWS} is {stated[:20]!r}: the file is cut off or was edited: put it "
            "back, or correct or clear this cell"
        )


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
