"""The file of the table that turns what speaks for a name into its confidence."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path
from typing import Any

from identification.criteria import FORM
from identification.discrepancy.confidence import Table
from identification.errors import ConfidenceTableError

FORMAT, FORMAT_VERSION = "damper-rig/confidence-table", 2
PATH = Path(__file__).with_name("confidence.json")


@cache
def fitted_table() -> Table:
    """The table that `python -m benchmarks.explain.calibrate` has fitted."""
    return read_table(PATH)


def read_table(path: str | os.PathLike[str]) -> Table:
    """A table from its file; raises ConfidenceTableError, in one line, when it can't be used."""
    try:
        return _table(json.loads(Path(path).read_text(encoding="utf-8")))
    except ConfidenceTableError as error:
        raise ConfidenceTableError(f"{path}: {error}") from error
    except (OSError, ValueError) as error:
        raise ConfidenceTableError(f"{path}: no table of confidence: {error}") from error


def table_to_json(table: Table) -> dict[str, Any]:  # Any: JSON
    """The table as JSON data."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "form_tolerance": FORM.tolerance,
        "names": table.names,
        "without_doubt": table.without_doubt,
        "weights": dict(table.weights),
        "most": list(table.most),
        "sure_from": table.sure_from,
    }


def _table(data: Any) -> Table:  # Any: parsed JSON, of any shape
    if not isinstance(data, dict) or (data.get("format"), data.get("format_version")) != (FORMAT, FORMAT_VERSION):
        raise ConfidenceTableError(f"format must be {FORMAT}, version {FORMAT_VERSION}")
    if data.get("form_tolerance") != FORM.tolerance:
        raise ConfidenceTableError(
            f"form_tolerance is {data.get('form_tolerance')} and not {FORM.tolerance}: fit the table again"
        )
    weights = data.get("weights")
    if not isinstance(weights, dict):
        raise ConfidenceTableError("weights must be an object of numbers")
    most = data.get("most")
    if not isinstance(most, list) or len(most) != 2:
        raise ConfidenceTableError("most must be a list of two numbers, of one run and of two")
    return Table(
        without_doubt=_number("without_doubt", data.get("without_doubt")),
        weights={name: _number(f"weights.{name}", w) for name, w in weights.items()},
        most=(_number("most.0", most[0]), _number("most.1", most[1])),
        sure_from=_number("sure_from", data.get("sure_from")),
        names=int(_number("names", data.get("names"))),
    )


def _number(where: str, value: Any) -> float:  # Any: parsed JSON
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfidenceTableError(f"{where} is {value!r}: it must be a number")
    return float(value)
