"""The runs in one file: the part that is wanted, whole or cut into its levels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final
from uuid import uuid4

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.choice import Choice
from rigctl.foreign_files.imported import Imported, import_table, lacking
from rigctl.foreign_files.levels import Level, levels_of
from rigctl.foreign_files.read import read_tables, refusing
from rigctl.foreign_files.table import Progress, Table
from rigctl.foreign_files.time_bases import on_one_time
from rigctl.runfile import Run

__all__ = ["ALL_PARTS", "import_file", "import_tables"]

ALL_PARTS: Final = "all"
_MOST_SAMPLES: Final = 1_000_000  # in which levels are sought unasked: 0.3 s
_MOST_OF_IT: Final = 0.8  # share of a record that one level fills: it is of that kind
_CUT_CYCLES: Final = 2.5  # at both ends together


def import_file(
    path: Path, choice: Choice, *, split: bool = False, tell: Progress = lambda done: None
) -> tuple[Imported, ...]:
    """Every run of a file: one, one for each part (``choice.part`` "all"), or one for each level (``split``).

    Raises
    ------
    ForeignFileError
        One line that begins with the name of the file: what is missing or wrong, where, and what would be right.
    """
    with refusing(path):
        return import_tables(path, read_tables(path, choice), choice, split=split, tell=tell)


def import_tables(
    path: Path | None,
    tables: tuple[Table, ...],
    choice: Choice,
    *,
    split: bool = False,
    tell: Progress = lambda done: None,
) -> tuple[Imported, ...]:
    """Every run in the tables of a file, or of memory (``path`` None). Raises ForeignFileError, one line."""
    tables = tuple(_wanted(tables, choice))
    whole = [import_table(path, table, choice, tell) for table in tables]
    if len(whole) > 1:
        whole = [_named(one, table.part) for one, table in zip(whole, tables, strict=True)]
    return tuple(piece for one in whole for piece in (_pieces(one) if split else [_kind_seen(one, choice)]))


def _wanted(tables: tuple[Table, ...], choice: Choice) -> list[Table]:
    if not tables:
        raise ForeignFileError("it holds no columns of numbers")
    if choice.part and choice.part != ALL_PARTS:
        found = [table for table in tables if table.part == choice.part]
        if not found:
            raise ForeignFileError(f"it has no part {choice.part!r:.40}: it has {_names(tables)}")
        return found
    if len(tables) == 1:
        return list(tables)
    usable = [table for table in tables if not lacking(table, choice)]
    if choice.part == ALL_PARTS and usable:
        return usable
    if len(usable) > 1:
        raise ForeignFileError(f"several parts hold a run: --part NAME with one of {_names(usable)}, or --part all")
    joined = None if usable else on_one_time(tables, choice)
    if joined is not None:
        return [joined]
    if not usable:
        why = "; ".join(lacking(tables[0], choice))
        raise ForeignFileError(f"no part of it holds a run ({_names(tables)}); the first: {why}")
    return usable


def _names(tables: tuple[Table, ...] | list[Table]) -> str:
    return ", ".join(repr(table.part) for table in tables[:8]) + (" …" if len(tables) > 8 else "")


def _named(one: Imported, part: str) -> Imported:
    return replace(one, run=replace(one.run, test_id=part))


def _kind_seen(one: Imported, choice: Choice) -> Imported:
    """A run of a single level is of that level's kind; several are told."""
    if choice.kind or one.run.samples > _MOST_SAMPLES:
        return one
    levels = levels_of(one.run.channels["displacement"], one.run.sample_rate_hz)
    if len(levels) == 1 and _fills(levels[0], one.run):
        return replace(one, run=replace(one.run, excitation_kind=str(levels[0].kind)))
    if len(levels) > 1:
        shown = "; ".join(map(str, levels[:4])) + (" …" if len(levels) > 4 else "")
        return replace(one, told=(*one.told, f"it holds {len(levels)} levels ({shown}): --split makes a run of each"))
    return one


def _fills(level: Level, run: Run) -> bool:
    """Whether a level is most of a record, or all but the cycles that the record cuts at its ends."""
    cut = _CUT_CYCLES * run.sample_rate_hz / level.frequency_hz
    return level.stop - level.start + cut > run.samples or level.stop - level.start > _MOST_OF_IT * run.samples


def _pieces(one: Imported) -> list[Imported]:
    levels = levels_of(one.run.channels["displacement"], one.run.sample_rate_hz)
    if not levels:
        raise ForeignFileError(
            "--split: no motion repeats three times with one amplitude and frequency: leave it whole"
        )
    return [replace(one, run=_piece(one.run, level), told=one.told if k == 0 else ()) for k, level in enumerate(levels)]


def _piece(run: Run, level: Level) -> Run:
    return replace(
        run,
        run_id=uuid4().hex,
        excitation_kind=str(level.kind),
        test_id=", ".join(filter(None, (run.test_id, str(level)))),
        channels={name: values[level.start : level.stop].copy() for name, values in run.channels.items()},
    )
