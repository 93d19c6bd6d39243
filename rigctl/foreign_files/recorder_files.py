"""Files of data acquisition systems: UFF 58, MDF 4, TDMS and Parquet, each by the library that is made for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.channels_table import Array, table_of
from rigctl.foreign_files.headings import split_heading
from rigctl.foreign_files.library import extra, read_by_library
from rigctl.foreign_files.table import Progress, Table, Values

__all__ = ["read_mdf", "read_parquet", "read_tdms", "read_uff"]

_TIME_RESPONSE: Final = 1  # the kind of function in a set of UFF 58
_FREE: Final = 64 << 20  # bytes of one column that a small file may unpack to
_MOST_RATIO: Final = 107  # of unpacked to packed, as for run files: a time alone packs worse than a constant


def read_uff(path: Path) -> tuple[Table, ...]:
    """A table of all time responses (sets of type 58); sets of another rate or length are another one."""
    with read_by_library("UFF"):
        file = extra("pyuff", "UFF").UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        wanted = [k for k, kind in enumerate(kinds) if kind == 58]
        sets = [file.read_sets(k) for k in wanted]
        groups: dict[tuple[int, float], list[Array]] = {}
        for n, one in enumerate(sets, start=1):
            if int(one.get("func_type", _TIME_RESPONSE)) not in (0, _TIME_RESPONSE):
                continue
            values, interval = np.real(np.asarray(one["data"])).astype(np.float64).ravel(), _uff_interval(one)
            groups.setdefault((values.size, interval), []).append(_uff_array(one, values, n))
        tables = [
            table_of(
                arrays,
                part=f"{size} samples" if len(groups) > 1 else "",
                sample_rate_hz=1.0 / interval,
                layout="UFF 58",
            )
            for (size, interval), arrays in groups.items()
        ]
    if not sets:
        raise ForeignFileError("it has no set of type 58: a UFF file with time responses is needed")
    return tuple(table for table in tables if table is not None)


def _uff_interval(one: dict[str, Any]) -> float:
    """Seconds between samples, checked where each has a time of its own."""
    x = np.asarray(one["x"], dtype=np.float64).ravel()
    steps = np.diff(x)
    interval = float(one.get("abscissa_inc") or 0.0) or float(np.median(steps))
    if not interval > 0.0 or (int(one.get("abscissa_spacing", 1)) == 0 and np.ptp(steps) > 1e-3 * interval):
        raise ForeignFileError("the times of a set are uneven: write it with an even abscissa")
    return float(f"{interval:.9g}")


def _uff_array(one: dict[str, Any], values: NDArray[np.float64], n: int) -> Array:
    texts = [str(one.get(key, "")).strip() for key in ("rsp_ent_name", "id1", "ordinate_axis_lab")]
    name = next((text for text in texts if text and text.upper() != "NONE"), f"set {n}")
    unit = str(one.get("ordinate_axis_units_lab", "")).strip()
    return Array(name=name, unit="" if unit.upper() == "NONE" else unit, values=values)


def read_mdf(path: Path) -> tuple[Table, ...]:
    """A table for each group of channels with one time base."""
    asammdf = extra("asammdf", "MDF")
    with read_by_library("MDF"), asammdf.MDF(str(path)) as file:
        tables = [_mdf_group(file, k) for k in range(len(file.groups))]
    found = [table for table in tables if table is not None]
    if not found:
        raise ForeignFileError("it has no group of numeric channels")
    return _merged(found)


def _mdf_group(file: Any, k: int) -> Table | None:
    master = file.masters_db.get(k)
    arrays, times = [], None
    for index, channel in enumerate(file.groups[k].channels):
        if index == master:
            continue
        signal = file.get(group=k, index=index)
        if signal.samples.ndim == 1 and signal.samples.dtype.kind in "fiub":
            times = signal.timestamps
            arrays.append(Array(name=channel.name, unit=signal.unit or "", values=signal.samples.astype(np.float64)))
    if times is None:
        return None
    time = Array(name="time", unit="s", values=np.asarray(times, dtype=np.float64))
    return table_of([time, *arrays], part=f"group {k + 1}", layout="MDF")


def _merged(tables: Sequence[Table]) -> tuple[Table, ...]:
    """One table where all groups have the same times; else each of its own."""
    every = [table.take(range(len(table.heads)), lambda done: None).columns for table in tables]
    if any(c[0].shape != every[0][0].shape or not np.array_equal(c[0], every[0][0]) for c in every):
        return tuple(tables)
    arrays = [
        Array(name=head.name, unit=head.unit, values=values)
        for n, (table, columns) in enumerate(zip(tables, every, strict=True))
        for head, values in list(zip(table.heads, columns, strict=True))[1 if n else 0 :]
    ]
    one = table_of(arrays, layout="MDF")
    return tuple(tables) if one is None else (one,)


def read_tdms(path: Path) -> tuple[Table, ...]:
    """A table for each group; the rate is that of the waveforms where they state one."""
    nptdms = extra("nptdms", "TDMS")
    with read_by_library("TDMS"):
        file = nptdms.TdmsFile.read(str(path))
        groups = [(group.name, list(group.channels())) for group in file.groups()]
        tables = [_tdms_group(name if len(groups) > 1 else "", channels) for name, channels in groups]
    found = tuple(table for table in tables if table is not None)
    if not found:
        raise ForeignFileError("it has no group of numeric channels")
    return found


def _tdms_group(name: str, channels: Sequence[Any]) -> Table | None:
    arrays, intervals = [], set()
    for channel in channels:
        values = channel[:]
        if values.dtype.kind == "M":
            values, unit = (values - values[0]) / np.timedelta64(1, "ns") * 1e-9 if values.size else values, "s"
        elif values.dtype.kind in "fiu":
            unit = str(channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or "")
            intervals.add(float(channel.properties.get("wf_increment") or 0.0))
        else:
            continue
        arrays.append(Array(name=channel.name, unit=unit, values=np.asarray(values, dtype=np.float64)))
    interval = intervals.pop() if len(intervals) == 1 else 0.0
    return table_of(arrays, part=name, sample_rate_hz=1.0 / interval if interval > 0.0 else None, layout="TDMS")


def read_parquet(path: Path) -> tuple[Table, ...]:
    """The one table of a Parquet file; its columns are read when they are asked for."""
    import pyarrow as pa
    from pyarrow import parquet

    with read_by_library("Parquet"):
        file = parquet.ParquetFile(path)
        schema, rows = file.schema_arrow, file.metadata.num_rows
    most = max(_FREE, _MOST_RATIO * path.stat().st_size) // 8
    if not 2 <= rows <= most:
        raise ForeignFileError(f"it states {rows} rows: a file of its size has at most {most}, and a run two or more")
    names = list(schema.names)
    numeric = [pa.types.is_integer(kind) or pa.types.is_floating(kind) for kind in schema.types]
    times = [pa.types.is_timestamp(kind) or pa.types.is_duration(kind) for kind in schema.types]

    def take(indices: Sequence[int], tell: Progress) -> Values:
        with read_by_library("Parquet"):
            columns = [
                _arrow_numbers(parquet.read_table(path, columns=[names[k]]).column(0), times[k]) for k in indices
            ]
        tell(1.0)
        return Values(columns=tuple(columns))

    heads = [split_heading(name) for name in names]
    return (
        Table(
            heads=tuple(
                type(head)(head.name, head.unit, stamps=stamp, number=number)
                for head, number, stamp in zip(heads, numeric, times, strict=True)
            ),
            take=take,
            layout="Parquet",
        ),
    )


def _arrow_numbers(column: Any, times: bool) -> NDArray[np.float64]:
    """Any: a column of Arrow. Times become seconds since the first."""
    values = column.to_numpy()
    if not times:
        return np.asarray(values, dtype=np.float64)
    known = values[~np.isnat(values)]
    since = values - known[0] if values.dtype.kind == "M" and known.size else values
    return np.asarray(since / np.timedelta64(1, "ns") * 1e-9, dtype=np.float64)
