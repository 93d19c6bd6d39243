"""MATLAB files: vectors, columns of matrices, and fields of structures; version 5 to 7 by scipy, 7.3 as HDF5."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory
from typing import Any, Final

import h5py
import numpy as np

from excitation.errors import ExcitationFileError
from excitation.untrusted import DAMAGE, check_mat, open_hdf5
from rigctl.errors import ForeignFileError
from rigctl.foreign_files.channels_table import Array, table_of
from rigctl.foreign_files.table import Table

__all__ = ["read_matlab"]

_RATES: Final = ("fs", "f_s", "samplerate", "sample_rate", "samplingrate", "sampling_rate", "abtastrate", "fabt")
_INTERVALS: Final = ("dt", "ts", "t_s", "sampletime", "sample_time")
_MOST_COLUMNS: Final = 64  # of one matrix: a larger one is a picture or a map
_LAYOUT: Final = "MATLAB"
_USER_BLOCK: Final = 512  # bytes of text before the HDF5 file of version 7.3
_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"


def read_matlab(path: Path) -> tuple[Table, ...]:
    """A table for each structure, and one of the variables beside them; raises ForeignFileError."""
    with path.open("rb") as file:
        is_hdf5 = b"MATLAB 7.3" in file.read(128)
    variables = dict(_hdf5_variables(path) if is_hdf5 else _variables(path))
    groups: dict[str, dict[str, Any]] = {}
    for name, value in variables.items():
        part, _, rest = name.rpartition(".")
        groups.setdefault(part, {})[rest] = value
    rates = {part: _rate(group) for part, group in groups.items()}
    tables = [
        table_of(_arrays(group), part=part, sample_rate_hz=rates[part] or rates.get(""), layout=_LAYOUT)
        for part, group in groups.items()
    ]
    return tuple(table for table in tables if table is not None)


def _variables(path: Path) -> Iterator[tuple[str, Any]]:
    """Names, with the structures they are in, and numeric arrays. Any: a MAT file may hold anything."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        check_mat(path)
        content = loadmat(path, simplify_cells=True, chars_as_strings=True)
    except ExcitationFileError as error:
        raise ForeignFileError(str(error).removeprefix(f"{path}: ")) from error
    except (MatReadError, NotImplementedError, *DAMAGE) as error:
        raise ForeignFileError(f"damaged or not a MATLAB file ({' '.join(str(error).split())[:120]})") from error
    yield from _flat({name: value for name, value in content.items() if not name.startswith("__")}, "")


def _flat(content: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _hdf5_variables(path: Path) -> Iterator[tuple[str, Any]]:
    """The same of version 7.3, without what needs references (cells, tables); whole and checked, as every HDF5 file."""
    found: list[tuple[str, Any]] = []

    def keep(name: str, item: Any) -> None:  # Any: a group or a dataset
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu":
            found.append((name.replace("/", "."), np.asarray(item[...], dtype=np.float64).T))

    with TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.h5"
        _without_user_block(path, plain)
        with open_hdf5(plain, _Refused) as file:
            try:
                file.visititems(keep)
            except DAMAGE as error:
                raise ForeignFileError(f"damaged ({' '.join(str(error).split())[:120]}): save it again") from error
    yield from found


def _without_user_block(path: Path, plain: Path) -> None:
    """Copy the HDF5 file behind MATLAB's text, so that it is checked as all HDF5 files are.

    Superblock of version 0: its base address, at byte 24, was the length of the text; the end of the file, at byte 40,
    counts from the base (HDF5 File Format Specification 3.0, II.A).
    """
    with path.open("rb") as file, plain.open("wb") as copy:
        file.seek(_USER_BLOCK)
        head = bytearray(file.read(96))
        if head[:8] != _SIGNATURE or head[8] != 0:
            raise _Refused("its HDF5 part is none that MATLAB writes")
        base, end = (int.from_bytes(head[k : k + 8], "little") for k in (24, 40))
        head[24:32] = bytes(8)
        head[40:48] = max(end - base, 0).to_bytes(8, "little")
        copy.write(head)
        copyfileobj(file, copy)


class _Refused(ForeignFileError):
    """A file of version 7.3 that holds more than numbers."""

    def __init__(self, message: str) -> None:
        super().__init__(f"{message.split(': ', 1)[-1]}; MATLAB's save with '-v7' writes a file that can be read")


def _rate(group: dict[str, Any]) -> float | None:
    """The sample rate that a variable of a usual name states, Hz."""
    for name, value in group.items():
        word = name.casefold()
        if (
            np.size(value) == 1
            and np.asarray(value).dtype.kind in "fiu"
            and (number := float(np.ravel(value)[0])) > 0.0
        ):
            if word in _RATES:
                return number
            if word in _INTERVALS:
                return 1.0 / number
    return None


def _arrays(group: dict[str, Any]) -> list[Array]:
    found = []
    for name, value in group.items():
        numbers = np.asarray(value)
        if numbers.dtype.kind not in "fiu" or numbers.size < 2 or numbers.ndim > 2:
            continue
        if numbers.ndim == 1 or 1 in numbers.shape:
            found.append(Array(name=name, unit="", values=numbers.ravel().astype(np.float64)))
        elif numbers.shape[1] <= _MOST_COLUMNS:
            columns = numbers.T.astype(np.float64)
            found += [
                Array(name=f"{name} column {k}", unit="", values=column) for k, column in enumerate(columns, start=1)
            ]
    return found
