"""Which column of a table is which channel: as stated, and else by name, unit and kind of its cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.choice import ColumnChoice
from rigctl.foreign_files.headings import Head, role_of, suits
from rigctl.foreign_files.table import Table
from rigctl.foreign_files.units import SI, fits

__all__ = ["NONE", "Found", "find_columns"]

NONE: Final = "none"  # as the name of a column: the channel is not taken
_BY_UNIT: Final = ("force", "displacement", "current", "temperature")  # the only column with such a unit is it


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The column of one channel; ``why``: stated, or what it was guessed from. ``unit`` "" where nobody states it."""

    index: int
    head: Head
    unit: str
    why: str


def find_columns(table: Table, stated: Mapping[str, ColumnChoice]) -> tuple[dict[str, Found], dict[str, str]]:
    """The columns of the channels, and for each channel that several columns could be, a question.

    Raises ForeignFileError where a stated column is not there, or there twice.
    """
    found = {role: _stated(table, role, one) for role, one in stated.items() if one.column.casefold() != NONE}
    taken = {one.index for one in found.values()}
    open_roles = [role for role in SI if role not in stated]
    questions: dict[str, str] = {}
    for role in open_roles:
        best = _best(table.heads, role, taken)
        if len(best) == 1:
            k, why = best[0]
            found[role] = Found(index=k, head=table.heads[k], unit=table.heads[k].unit, why=why)
        elif best:
            questions[role] = _question(role, [k for k, _ in best], table.heads)
    taken = {one.index for one in found.values()}
    for role in (role for role in _BY_UNIT if role in open_roles and role not in found and role not in questions):
        alone = [k for k, head in enumerate(table.heads) if k not in taken and head.unit and fits(head.unit, role)]
        nameless = [k for k in alone if not role_of(table.heads[k])[0]]
        if len(alone) == len(nameless) == 1:
            k = nameless[0]
            found[role] = Found(index=k, head=table.heads[k], unit=table.heads[k].unit, why="its unit")
    return found, questions


def _best(heads: Sequence[Head], role: str, taken: set[int]) -> list[tuple[int, str]]:
    """The columns that fit best, several where they fit alike."""
    merits: dict[int, int] = {}
    for k, head in enumerate(heads):
        meant, sure = role_of(head)
        time = role == "time" and head.stamps
        if k in taken or (head.stamps and not time) or not (time or (meant == role and suits(head, role))):
            continue
        merits[k] = (2 * sure if meant == role else 1) + (1 if head.unit else 0)
    top = max(merits.values(), default=0)
    return [(k, "its name") for k, merit in merits.items() if merit == top]


def _question(role: str, several: Sequence[int], heads: Sequence[Head]) -> str:
    names = [f"{heads[k].name} ({heads[k].unit})" if heads[k].unit else heads[k].name for k in several]
    if len(set(names)) == 1:
        places = " or ".join(f"--{role} '#{k + 1}'" for k in several)
        return f"{len(several)} columns are named {names[0]!r}: choose one by its place, {places}"
    return f"{role} may be {' or '.join(repr(name) for name in names[:5])}: choose one by --{role} NAME:UNIT"


def _stated(table: Table, role: str, one: ColumnChoice) -> Found:
    whole = str(one)  # a name may hold a colon
    for name, unit in ((whole, ""), (one.column, one.unit)):
        k = _index(table.heads, name, unit, role)
        if k is not None:
            head = table.heads[k]
            if not (head.number or head.stamps):
                raise ForeignFileError(f"{role}: column {head.name!r:.60} holds text: numbers are due")
            if head.stamps and role != "time":
                raise ForeignFileError(f"{role}: column {head.name!r:.60} holds times of day: numbers are due")
            return Found(index=k, head=head, unit=unit or head.unit, why="stated")
    there = ", ".join(repr(head.name) for head in table.heads[:12]) + (" …" if len(table.heads) > 12 else "")
    raise ForeignFileError(f"{role}: there is no column {one.column!r:.60}: there are {there}")


def _index(heads: Sequence[Head], name: str, unit: str, role: str) -> int | None:
    if name.startswith("#") and name[1:].isdecimal() and 1 <= int(name[1:]) <= len(heads):
        return int(name[1:]) - 1
    same = [k for k, head in enumerate(heads) if head.name == name or f"{head.name} ({head.unit})" == name]
    same = same or [k for k, head in enumerate(heads) if head.name.casefold() == name.casefold()]
    if len(same) > 1 and unit:
        same = [k for k in same if heads[k].unit == unit] or same
    if len(same) > 1:
        fitting = [k for k in same if suits(heads[k], role) and heads[k].unit]
        same = fitting if len(fitting) == 1 else same
    if len(same) > 1:
        raise ForeignFileError(_question(role, same, heads))
    return same[0] if same else None
