"""Groups of one file whose channels have times of their own: put on one time where that is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.channels_table import Array, table_of
from rigctl.foreign_files.choice import Choice
from rigctl.foreign_files.clock import resampled
from rigctl.foreign_files.columns import Found, find_columns
from rigctl.foreign_files.table import Table
from rigctl.foreign_files.units import scale_to_si

__all__ = ["on_one_time"]

Floats = NDArray[np.float64]

_MOTION: Final = ("displacement", "velocity")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Channel:
    """Where one channel of the run stands."""

    role: str
    found: Found
    table: Table


def on_one_time(tables: Sequence[Table], choice: Choice) -> Table | None:
    """One table of the channels that stand in several groups; None where they are not those of a run together.

    Raises
    ------
    ForeignFileError
        Where nobody asked for resampling, or the groups have no times in common.
    """
    channels = _channels(tables, choice)
    roles = {one.role for one in channels}
    if "force" not in roles or not roles & set(_MOTION):
        return None
    if choice.resample_hz is None:
        where = ", ".join(f"{one.role} in {one.table.part!r:.40}" for one in channels[:4])
        raise ForeignFileError(
            f"its groups have times of their own ({where}): --resample HZ puts them on one time, --part NAME takes one"
        )
    return _joined(channels, choice.resample_hz)


def _channels(tables: Sequence[Table], choice: Choice) -> list[_Channel]:
    """Each channel from the first group that has it, and a time."""
    channels: dict[str, _Channel] = {}
    for table in tables:
        stated = {
            role: one for role, one in choice.columns.items() if any(head.name == one.column for head in table.heads)
        }
        found, _ = find_columns(table, stated)
        if "time" not in found and table.sample_rate_hz is None:
            continue
        for role, one in found.items():
            if role != "time":
                channels.setdefault(role, _Channel(role=role, found=one, table=table))
    return list(channels.values())


def _joined(channels: Sequence[_Channel], rate_hz: float) -> Table | None:
    """The channels by linear interpolation at even times that all of them have."""
    read = [(one, *_times_and_values(one)) for one in channels]
    begin, end = max(time[0] for _, time, _ in read), min(time[-1] for _, time, _ in read)
    count = int((end - begin) * rate_hz + 1e-6) + 1
    if count < 2:
        raise ForeignFileError("its groups have no times in common: choose one with --part NAME")
    even = begin + np.arange(count) / rate_hz
    arrays = [Array(name="time", unit="s", values=even - begin)]
    told = [f"groups with times of their own are put on one time from {begin:.4g} s on"]
    for one, time, values in read:
        _, notes = resampled(time, {one.role: values}, rate_hz, one.table.row)  # checks order and holes
        told += [f"{one.role}: {note}" for note in notes]
        arrays.append(Array(name=one.role, unit=one.found.unit, values=np.interp(even, time, values)))
    table = table_of(arrays, layout=f"{channels[0].table.layout}, groups joined")
    return None if table is None else replace(table, told=tuple(told))


def _times_and_values(one: _Channel) -> tuple[Floats, Floats]:
    """Times, s, and values of a channel in its unit."""
    found, _ = find_columns(one.table, {})
    if "time" not in found:
        (values,) = one.table.take([one.found.index], lambda done: None).columns
        return np.arange(values.size) / float(one.table.sample_rate_hz or 1.0), values
    time, values = one.table.take([found["time"].index, one.found.index], lambda done: None).columns
    return scale_to_si(found["time"].unit or "s", "time").apply(time), values
