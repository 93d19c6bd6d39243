"""A feasible set, as an exploration gives it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.errors import DataError

_WRONG = "it must be what `study explore --json` prints"


def read_feasible(path: Path) -> list[dict[str, float]]:
    """The feasible samples in a file, `element.parameter` to value; raises DataError."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, RecursionError, json.JSONDecodeError) as error:
        raise DataError(f"{path}: cannot be read as JSON ({error}): {_WRONG}") from error
    return feasible_rows(data, str(path))


def feasible_rows(data: Any, where: str) -> list[dict[str, float]]:  # Any: JSON
    """The feasible samples in an exploration's JSON.

    Raises
    ------
    DataError
        Where it is none, or where its set has fewer than two samples.
    """
    if not isinstance(data, Mapping) or data.get("study") != "exploration":
        raise DataError(f"{where}: no exploration: {_WRONG}")
    try:
        names = [str(one["name"]) for one in data["parameters"]]
        rows = [dict(zip(names, map(float, row), strict=True)) for row in data["feasible_set"]]
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"{where}: its feasible set is damaged: {_WRONG}") from error
    if len(rows) < 2:
        raise DataError(
            f"{where}: {len(rows)} feasible samples: a spread needs two; widen the limits of the exploration"
        )
    return rows
