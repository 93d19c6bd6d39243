"""report.json as it is read back: what a discrepancy report says, checked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import TypeAdapter, ValidationError

from identification.errors import ReportFileError

FORMAT = "damper-rig/discrepancy-report"
FORMAT_VERSION = 1

# What JSON gives is of any type until it has been looked at.
Json = Any
_FINITE: dict[str, Any] = {"allow_inf_nan": False}  # Any: pydantic's configuration


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A fitted parameter."""

    __pydantic_config__: ClassVar = _FINITE
    value: float
    std: float | None
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """What an effect could be instead."""

    __pydantic_config__: ClassVar = _FINITE
    element: str
    confidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedEffect:
    """One named effect; gaps in N rms."""

    __pydantic_config__: ClassVar = _FINITE
    element: str
    path: str
    confidence: float
    parameters: dict[str, Value]
    alternatives: tuple[Alternative, ...]
    gap_before: float
    gap_after: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """rms of measured minus simulated force at each step, N; `closed` is told of held-out runs."""

    __pydantic_config__: ClassVar = _FINITE
    as_given: float
    base_refitted: float
    final: float
    noise_floor: float
    closed: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BothGaps:
    """The gap on the training runs and on the held-out ones."""

    train: Gap
    held_out: Gap


@dataclass(frozen=True, slots=True, kw_only=True)
class Where:
    """A stretch of one variable that holds much of the gap."""

    __pydantic_config__: ClassVar = _FINITE
    variable: str
    low: float
    high: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Remainder:
    """What stays."""

    repeatable: bool
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposed:
    """The next test."""

    text: str
    design: dict[str, object]


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Names of the runs."""

    train: tuple[str, ...]
    held_out: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Distortion:
    """Force and gap by kind before any model, N rms, and that in words."""

    __pydantic_config__: ClassVar = _FINITE
    runs: tuple[str, ...]
    force: dict[str, float]
    gap: dict[str, float]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """The content of report.json that its page shows."""

    verdict: Literal["no_discrepancy", "explained", "partly_explained", "unknown_effect"]
    effects: tuple[NamedEffect, ...]
    gap: BothGaps
    where: tuple[Where, ...]
    remainder: Remainder
    next_test: Proposed
    runs: Runs
    notes: tuple[str, ...]
    distortion: Distortion | None = None  # earlier reports have none


def fingerprint(data: Mapping[str, Json]) -> str:
    """SHA-256 of the content of a report.json, whatever the order of its keys and its white space."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def read_report(path: Path) -> tuple[Report, str]:
    """What report.json says, and its fingerprint.

    Raises
    ------
    ReportFileError
        one line that names the file, the place in it and what would be right.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise ReportFileError(
            f"{path}: can't be read ({reason}): give the folder that 'damper-rig explain' wrote"
        ) from error
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ReportFileError(f"{path}: no JSON ({error})") from error
    _check_format(path, data)
    try:
        return TypeAdapter(Report).validate_json(text, strict=True), fingerprint(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ReportFileError(f"{path}: {place}: {first['msg']}") from error


def _check_format(path: Path, data: Json) -> None:
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else type(data).__name__
        raise ReportFileError(f"{path}: format is {str(found)[:60]!r}: a report has '{FORMAT}'")
    version = data.get("format_version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ReportFileError(f"{path}: format_version is {str(version)[:60]}: it must be a positive integer")
    if version > FORMAT_VERSION:
        raise ReportFileError(
            f"{path}: format_version is {version}: this program reads up to {FORMAT_VERSION}; update it"
        )
