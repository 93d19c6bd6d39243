"""RPC III time histories, read by the reader that the excitation files have."""

from __future__ import annotations

from pathlib import Path

from excitation.errors import ExcitationFileError
from excitation.rpc3 import TimeHistory, read_rpc3
from rigctl.errors import ForeignFileError
from rigctl.foreign_files.channels_table import Array, table_of
from rigctl.foreign_files.table import Table

__all__ = ["read_rpc"]


def read_rpc(path: Path) -> tuple[Table, ...]:
    """The one table of an RPC III file; raises ForeignFileError."""
    try:
        history = read_rpc3(path)
    except ExcitationFileError as error:
        raise ForeignFileError(str(error).removeprefix(f"{path}: ")) from error
    arrays = [Array(name=one.name, unit=one.unit, values=one.values) for one in history.channels]
    table = table_of(arrays, sample_rate_hz=history.sample_rate_hz, layout=_layout(history))
    return () if table is None else (table,)


def _layout(history: TimeHistory) -> str:
    padding = f"{history.padding} samples of padding left out" if history.padding else ""
    return ", ".join(part for part in ("RPC III", padding, history.scaling) if part)
