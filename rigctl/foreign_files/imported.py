"""A run from a table of another program: units, signs and times as chosen, everything checked, everything told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from rigctl.errors import ForeignFileError
from rigctl.foreign_files.choice import Choice, ColumnChoice
from rigctl.foreign_files.clock import read_clock, resampled
from rigctl.foreign_files.columns import Found, find_columns
from rigctl.foreign_files.headings import role_of
from rigctl.foreign_files.table import Progress, Table
from rigctl.foreign_files.units import SI, fits, scale_to_si
from rigctl.magnitudes import doubts_of
from rigctl.runfile import Run

__all__ = ["ColumnTaken", "Imported", "import_table", "lacking"]

Floats = NDArray[np.float64]

_EVERY: Final = ("force",)  # beside a motion and its times
_NEEDED: Final = ("time", "force", "displacement")  # never left out because of holes
_LEAST_S, _MOST_S = 1e-6, 0.2  # a time column without a unit is seconds where its steps are within
_NOT_CENTRED: Final = 0.5  # mean over peak to peak: beyond it a centred motion does not lie


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnTaken:
    """One line of what is shown: channel, column and unit in the file, how it was found, and its range in the run."""

    channel: str
    column: str
    unit: str
    why: str
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """A run, what was taken for it, and what there is to tell."""

    run: Run
    columns: tuple[ColumnTaken, ...]
    layout: str
    told: tuple[str, ...]
    choice: Choice


def lacking(table: Table, choice: Choice) -> list[str]:
    """Everything that keeps a table from being a run, a sentence each; empty where only its values can."""
    found, questions = find_columns(table, choice.columns)
    said = [questions[role] for role in questions if role in ("time", "displacement", "velocity", "force")]
    if not {"displacement", "velocity"} & (found.keys() | questions.keys()):
        unit = _unknown_unit(table, "displacement")
        said.append(unit or "no displacement (or velocity) is found: --displacement NAME:UNIT")
    open_roles = [role for role in _EVERY if role not in found | questions]
    said += [_unknown_unit(table, role) or f"no {role} is found: --{role} NAME:UNIT" for role in open_roles]
    if "time" not in found | questions and choice.rate_hz is None and table.sample_rate_hz is None:
        said.append("no time is found: --time NAME:UNIT, or --rate HZ")
    return said


def _unknown_unit(table: Table, role: str) -> str:
    """The column that is this channel by its name, and whose unit nobody knows; "" where there is none."""
    for head in table.heads:
        if head.number and head.unit and role_of(head)[0] == role and fits(head.unit, role) is None:
            return f"the unit {head.unit!r:.20} of {head.name!r:.40} is unknown: state it, --{role} '{head.name}:UNIT'"
    return ""


def import_table(path: Path | None, table: Table, choice: Choice, tell: Progress = lambda done: None) -> Imported:
    """Make the run of one table; ``path`` None: it stands in memory.

    Raises
    ------
    ForeignFileError
        One line with everything that is missing, or with what is wrong first: where it stands, and what would be right.
    """
    said = lacking(table, choice)
    if said:
        there = ", ".join(f"{h.name} [{h.unit}]" if h.unit else h.name for h in table.heads[:12])
        raise ForeignFileError(f"{'; '.join(said)} (columns: {there}{' …' if len(table.heads) > 12 else ''})")
    found, questions = find_columns(table, choice.columns)
    if choice.rate_hz is not None and "time" in found and found["time"].why != "stated" and table.sample_rate_hz:
        found.pop("time")
    values = table.take([one.index for one in found.values()], tell)
    raw, cut = dict(zip(found, values.columns, strict=True)), values.cut
    told = [*table.told, *values.told, *(f"not taken: {text}" for text in questions.values())]
    del values  # each column is freed as soon as it is converted
    told += _drop_empty(found, raw)
    units, guessed = _units(found, raw)
    told += guessed
    channels = {role: scale_to_si(units[role], role).apply(raw.pop(role)) for role in list(found)}
    _refuse_missing(channels, found, table)
    time_s = channels.pop("time", None)
    channels, rate_hz, more = _timed(time_s, channels, table, choice)
    told += more
    channels, signs = _signed(channels, choice, rate_hz)
    told += signs
    run = _run(path, channels, rate_hz, choice, cut=cut)
    told += _doubts(run)
    chosen = _resolved(choice, found, units, table)
    return Imported(
        run=replace(run, imported={"source": "" if path is None else path.name, "choice": chosen.as_json()}),
        columns=_taken(found, units, run),
        layout=table.layout,
        told=tuple(told),
        choice=chosen,
    )


def _drop_empty(found: dict[str, Found], raw: dict[str, Floats]) -> list[str]:
    """Leave out channels that nobody asked for and that have holes."""
    told = []
    for role in [role for role, one in found.items() if one.why != "stated"]:
        needed = role in _NEEDED or (role == "velocity" and "displacement" not in found)
        share = float(np.mean(~np.isfinite(raw[role]))) if raw[role].size and not needed else 0.0
        if share > 0.0:
            told.append(f"{role} is not taken: {100 * share:.2g} % of {found[role].head.name!r} is empty")
            del found[role], raw[role]
    return told


def _units(found: Mapping[str, Found], raw: Mapping[str, Floats]) -> tuple[dict[str, str], list[str]]:
    """The unit of each channel; a time without one is seconds where that can be. All others that lack one are named."""
    units, told, missing = {}, [], []
    for role, one in found.items():
        units[role] = "s" if one.head.stamps else one.unit
        if role == "time" and not units[role]:
            step = float(np.median(np.diff(raw[role]))) if raw[role].size > 1 else 0.0
            if _LEAST_S <= step <= _MOST_S:
                units[role] = "s"
                told.append(f"time has no unit: taken as seconds, a sample every {step:.4g} s")
        if not units[role]:
            missing.append(_unit_question(role, one, raw[role]))
        elif fits(units[role], role) is not True:
            scale_to_si(units[role], role)  # says why
    if missing:
        raise ForeignFileError("; ".join(missing))
    return units, told


def _unit_question(role: str, one: Found, values: Floats) -> str:
    span = float(np.nanmax(values) - np.nanmin(values)) if np.any(np.isfinite(values)) else 0.0
    likely = {"displacement": "mm" if span > 0.6 else "m", "force": "N" if span > 20.0 else "kN", "time": "ms"}.get(
        role, SI[role]
    )
    return (
        f"no unit is stated for {role} ({one.head.name!r}, which spans {span:.4g}): "
        f"--{role} '{one.head.name}:{likely}' if that is it"
    )


def _refuse_missing(channels: Mapping[str, Floats], found: Mapping[str, Found], table: Table) -> None:
    for role, values in channels.items():
        if not values.size:
            raise ForeignFileError("it has no line of data: a run needs two samples or more")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            shown = "empty" if np.isnan(values[bad[0]]) else "infinite"
            raise ForeignFileError(
                f"{table.row(int(bad[0]))}: {role} ({found[role].head.name!r}) is {shown} "
                f"({bad.size} such rows): correct the file, or leave these rows out"
            )


def _timed(
    time_s: Floats | None, channels: dict[str, Floats], table: Table, choice: Choice
) -> tuple[dict[str, Floats], float, tuple[str, ...]]:
    """Channels at even times, their rate, and what to tell."""
    stated = choice.rate_hz if choice.rate_hz is not None else table.sample_rate_hz
    if time_s is None:
        if stated is None:
            raise ForeignFileError("no time is found: --time NAME:UNIT, or --rate HZ")
        if next(iter(channels.values())).size < 2:
            raise ForeignFileError("1 sample: a run needs two or more")
        return channels, stated, ()
    if choice.resample_hz is not None:
        channels, told = resampled(time_s, channels, choice.resample_hz, table.row)
        return channels, choice.resample_hz, told
    clock = read_clock(time_s, table.row, stated)
    return channels, clock.rate_hz, clock.told


def _signed(channels: dict[str, Floats], choice: Choice, rate_hz: float) -> tuple[dict[str, Floats], list[str]]:
    """Signs turned and means taken off where asked for; a displacement from its velocity where there is none."""
    told = []
    for name in choice.flip:
        if name not in channels:
            raise ForeignFileError(f"--flip {name}: there is no such channel: there are {', '.join(channels)}")
        channels[name] = -channels[name]
        told.append(f"the sign of {name} is turned")
    if "displacement" not in channels:
        channels["displacement"] = _integral(channels["velocity"]) / rate_hz
        told.append("displacement is the integral of the velocity, without its mean; that of the velocity is taken off")
    for name in choice.centre:
        if name not in channels:
            raise ForeignFileError(f"--centre {name}: there is no such channel: there are {', '.join(channels)}")
        mean = float(np.mean(channels[name]))
        channels[name] = channels[name] - mean
        told.append(f"its mean, {mean:.5g} {SI[name]}, is taken off {name}")
    x = channels["displacement"]
    mean, span = float(np.mean(x)), float(np.ptp(x))
    if span > 0.0 and abs(mean) > _NOT_CENTRED * span:
        told.append(f"displacement has a mean of {mean:.4g} m: --centre displacement, if its zero means nothing")
    return channels, told


def _integral(v: Floats) -> Floats:
    """The integral over samples of a velocity without its mean over whole cycles, about its own mean."""
    up = np.flatnonzero((v[:-1] <= 0.0) & (v[1:] > 0.0))
    offset = float(np.mean(v[up[0] : up[-1]])) if up.size > 1 else float(np.mean(v))
    w = v - offset
    x = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]))])
    return np.asarray(x - np.mean(x))


def _run(path: Path | None, channels: dict[str, Floats], rate_hz: float, choice: Choice, *, cut: bool) -> Run:
    ordered = {name: np.ascontiguousarray(channels[name]) for name in SI if name in channels}
    made = datetime.now(UTC) if path is None else datetime.fromtimestamp(path.stat().st_mtime, UTC)
    return Run(
        run_id=uuid4().hex,
        created=made.isoformat(),
        specimen=choice.specimen,
        sample_rate_hz=rate_hz,
        period_samples=0,
        excitation_kind=choice.kind or Kind.CUSTOM,
        status="truncated" if cut else "complete",
        channels=ordered,
        units={name: SI[name] for name in ordered},
    )


def _doubts(run: Run) -> list[str]:
    doubts = doubts_of(run)
    impossible = next((doubt for doubt in doubts if doubt.impossible), None)
    if impossible is not None:
        raise ForeignFileError(
            f"{impossible.channel}: {impossible.text}: state its unit, --{impossible.channel} NAME:UNIT"
        )
    return [f"{doubt.channel}: {doubt.text}" for doubt in doubts]


def _resolved(choice: Choice, found: Mapping[str, Found], units: Mapping[str, str], table: Table) -> Choice:
    """The choice with every column by its name, or by its place where two have that name."""
    columns = {
        role: ColumnChoice(
            column=_name_of(one, table),
            unit="" if one.head.stamps else units[role],
        )
        for role, one in found.items()
    }
    absent = {role: one for role, one in choice.columns.items() if role not in columns}
    return replace(choice, columns={**columns, **absent})


def _name_of(one: Found, table: Table) -> str:
    """Its name; with its unit, or its place, where two columns have that name."""
    whole = f"{one.head.name} ({one.head.unit})"
    if [head.name for head in table.heads].count(one.head.name) == 1:
        return one.head.name
    alike = [head for head in table.heads if f"{head.name} ({head.unit})" == whole]
    return whole if len(alike) == 1 else f"#{one.index + 1}"


def _taken(found: Mapping[str, Found], units: Mapping[str, str], run: Run) -> tuple[ColumnTaken, ...]:
    rows = []
    for role, one in found.items():
        values = run.channels.get(role)
        ends = (
            (0.0, (run.samples - 1) / run.sample_rate_hz)
            if values is None
            else (float(values.min()), float(values.max()))
        )
        unit = "time of day" if one.head.stamps else units[role]
        rows.append(ColumnTaken(channel=role, column=one.head.name, unit=unit, why=one.why, low=ends[0], high=ends[1]))
    return tuple(rows)
