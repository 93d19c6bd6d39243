"""Runs as tables of pandas and xarray, and back; results as tables of pandas. Both are imported when they are used."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from damper_rig.loading import DataWarning, Taken, chosen_of, taken
from damper_rig.words import in_python
from identification.measured import check_runs
from rigctl.errors import ForeignFileError
from rigctl.foreign_files import Choice, Head, Table, Values, import_tables, split_heading
from rigctl.foreign_files.clock import read_clock
from rigctl.runfile import Run

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["Rows", "from_pandas", "from_xarray", "to_pandas", "to_xarray"]

Floats = NDArray[np.float64]
_TIME: Final = "time"
_MARK: Final = "damper_rig_run"  # attribute of a table that was a run
_KEPT: Final = (
    *("run_id", "created", "specimen", "excitation_kind", "status"),
    *("test_id", "campaign_id", "rig", "operator"),
)


class Rows(Protocol):
    """A result that is a list of dictionaries."""

    def rows(self) -> list[dict[str, Any]]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A column of a table in memory, (N,)."""

    name: str
    unit: str
    values: NDArray[Any]  # Any: numbers, times or text


def to_pandas(what: Run | Rows) -> pd.DataFrame:
    """A run as a table with the time, s, as index, or the rows of a result.

    The columns of a run are its channels, SI; `frame.attrs["units"]` holds their units.
    """
    import pandas as pd

    if not isinstance(what, Run):
        return pd.DataFrame(what.rows())
    frame = pd.DataFrame(dict(what.channels), index=pd.Index(_times(what), name=_TIME))
    frame.attrs.update({"units": {_TIME: "s", **what.units}, _MARK: _header(what)})
    return frame


def from_pandas(
    frame: pd.DataFrame,
    *,
    columns: Mapping[str, str] | None = None,
    flip: Sequence[str] = (),
    choice: Choice | None = None,
) -> Run:
    """The run in a table: one of `to_pandas`, or any other, which is read and checked as a file of another program is.

    Raises ForeignFileError or DataError, one line.
    """
    units = frame.attrs.get("units", {})
    index = frame.index
    whole = frame if index.name is None and index.dtype.kind in "iu" else frame.reset_index()
    found = [_column(str(name), str(units.get(name, "")), whole[name].to_numpy()) for name in whole.columns]
    run, notes = _run(found, frame.attrs.get(_MARK), chosen_of(columns, flip, choice), "DataFrame")
    for note in notes:
        warnings.warn(f"DataFrame: {note}", DataWarning, stacklevel=2)
    return run


def to_xarray(run: Run) -> xr.Dataset:
    """A run as a dataset over the time, s; every variable has its unit as attribute `units`."""
    import xarray as xr

    channels = {name: (_TIME, values, {"units": run.units[name]}) for name, values in run.channels.items()}
    times = {_TIME: (_TIME, _times(run), {"units": "s"})}
    return xr.Dataset(channels, coords=times, attrs={**_header(run), _MARK: 1})


def from_xarray(
    dataset: xr.Dataset,
    *,
    columns: Mapping[str, str] | None = None,
    flip: Sequence[str] = (),
    choice: Choice | None = None,
) -> Run:
    """The run in a dataset of one dimension, as `from_pandas` reads a table; units are the attributes `units`."""
    if len(dataset.sizes) != 1:
        raise ForeignFileError(f"Dataset: it has the dimensions {', '.join(map(str, dataset.sizes))}: one is due")
    found = [
        _column(str(name), str(one.attrs.get("units", "")), one.to_numpy()) for name, one in dataset.variables.items()
    ]
    own = dataset.attrs if dataset.attrs.get(_MARK) else None
    run, notes = _run(found, own, chosen_of(columns, flip, choice), "Dataset")
    for note in notes:
        warnings.warn(f"Dataset: {note}", DataWarning, stacklevel=2)
    return run


def _times(run: Run) -> Floats:
    return np.arange(run.samples) / run.sample_rate_hz


def _header(run: Run) -> dict[str, str | int]:
    return {"period_samples": run.period_samples, **{name: getattr(run, name) for name in _KEPT}}


def _column(name: str, unit: str, values: NDArray[Any]) -> _Column:
    if values.dtype.kind == "m":
        return _Column(name=name, unit="s", values=values / np.timedelta64(1, "s"))
    head = Head(name, unit) if unit else split_heading(name)
    return _Column(name=head.name, unit=head.unit, values=values)


def _run(found: Sequence[_Column], header: Mapping[str, Any] | None, choice: Choice, what: str) -> Taken:
    try:
        if header is not None and choice == Choice():
            return _own(found, header), ()
        (one,) = import_tables(None, (_table(found, what),), choice)
    except ForeignFileError as error:
        raise ForeignFileError(in_python(f"{what}: {error}")) from error
    return taken(one)


def _own(found: Sequence[_Column], header: Mapping[str, Any]) -> Run:
    """A table that was a run, whatever was done to it since: times and values are checked again."""
    columns = {one.name: one for one in found}
    if _TIME not in columns:
        raise ForeignFileError(f"there is no {_TIME!r}: keep the index of the run")
    time_s = columns.pop(_TIME).values.astype(np.float64)
    run = Run(
        sample_rate_hz=read_clock(time_s, lambda n: f"row {n}").rate_hz,
        channels={name: np.ascontiguousarray(one.values, dtype=np.float64) for name, one in columns.items()},
        units={name: one.unit for name, one in columns.items()},
        period_samples=int(header["period_samples"]),
        run_id=str(header["run_id"]),
        created=str(header["created"]),
        specimen=str(header["specimen"]),
        excitation_kind=str(header["excitation_kind"]),
        status=str(header["status"]),
        test_id=str(header["test_id"]),
        campaign_id=str(header["campaign_id"]),
        rig=str(header["rig"]),
        operator=str(header["operator"]),
    )
    check_runs([run])
    return run


def _table(found: Sequence[_Column], what: str) -> Table:
    def take(indices: Sequence[int], tell: Any) -> Values:  # Any: told the share that is done
        return Values(columns=tuple(_numbers(found[k].values) for k in indices))

    heads = [Head(c.name, c.unit, c.values.dtype.kind == "M", c.values.dtype.kind in "iuf") for c in found]
    return Table(heads=tuple(heads), take=take, layout=what, row=lambda n: f"row {n}")


def _numbers(values: NDArray[Any]) -> Floats:
    """As float64; times of day are seconds since the first."""
    if values.dtype.kind == "M":
        return np.asarray((values - values[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    return np.ascontiguousarray(values, dtype=np.float64)
