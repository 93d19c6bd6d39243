"""evidence.h5: what the page of a report draws, in HDF5; a group for each class, a dataset for each field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import written_whole
from excitation.untrusted import DAMAGE, Limits, open_hdf5
from identification.errors import OutputError, ReportFileError
from identification.report.page_data import PageData

FORMAT = "damper-rig/report-evidence"
FORMAT_VERSION = 1
_MOST_BYTES = 1 << 26  # of one dataset, unpacked: the largest that is written has some kilobytes
_MOST_MEMBERS = 256  # of one group of curves: a page shows at most some ten

# The type of a field is any, and so is its value, until it has been looked at.
Kind = Any
Value = Any


def write_evidence(path: Path, data: PageData) -> None:
    """Write the file whole or not at all."""
    with written_whole(path, OutputError) as temporary, h5py.File(temporary, "w", libver=("earliest", "v110")) as file:
        file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
        _write_fields(file, data)


def read_evidence(path: Path) -> PageData:
    """Read the file and check all of it.

    Raises
    ------
    ReportFileError
        one line that names the file and the place in it, when it is missing, damaged, foreign, of a later version, or
        holds anything but plain numbers and text of the right shape.
    """
    if not path.is_file():
        raise ReportFileError(f"{path}: no such file: give the folder that 'damper-rig explain' wrote")
    try:
        with open_hdf5(path, ReportFileError, limits=Limits(booleans=True)) as file:
            _check_format(file)
            data: PageData = _read_fields(file, PageData, "")
            return data
    except ReportFileError as error:
        text = str(error)
        raise ReportFileError(text if text.startswith(f"{path}: ") else f"{path}: {text}") from None
    except DAMAGE as error:
        reason = " ".join(str(error).split())[:160]
        raise ReportFileError(f"{path}: damaged or not an HDF5 file ({reason})") from error


def _write_fields(group: h5py.Group, data: Value) -> None:
    kinds = get_type_hints(type(data))
    for field in fields(data):
        _write(group, field.name, getattr(data, field.name), kinds[field.name])


def _write(group: h5py.Group, name: str, value: Value, kind: Kind) -> None:
    if value is None:
        return
    if is_dataclass(value):
        _write_fields(group.create_group(name), value)
    elif isinstance(value, str):
        group.create_dataset(name, data=_encoded([value]).reshape(()))
    elif not isinstance(value, tuple):
        group.create_dataset(name, data=value)
    elif get_args(kind)[0] is str:
        group.create_dataset(name, data=_encoded(value))
    else:
        members = group.create_group(name)
        for number, member in enumerate(value):
            _write_fields(members.create_group(str(number)), member)


def _encoded(texts: Sequence[str]) -> NDArray[np.bytes_]:
    """UTF-8 of one length for all, which may hold any character."""
    encoded = [text.encode() for text in texts]
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", max([1, *map(len, encoded)])))


def _check_format(file: h5py.File) -> None:
    found = file.attrs.get("format")
    if not isinstance(found, str) or found != FORMAT:
        raise ReportFileError(f"attribute format is {str(found)[:60]!r}: the evidence of a report says {FORMAT!r}")
    version = file.attrs.get("format_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise ReportFileError(f"attribute format_version is {str(version)[:60]}: it must be a positive integer")
    if version > FORMAT_VERSION:
        raise ReportFileError(f"format_version is {version}: this program reads up to {FORMAT_VERSION}; update it")


def _read_fields(group: h5py.Group, kind: Kind, place: str) -> Value:
    hints = get_type_hints(kind)
    values = {f.name: _read(group, f.name, hints[f.name], f"{place}/{f.name}") for f in fields(kind)}
    try:
        return kind(**values)
    except ReportFileError as error:
        raise ReportFileError(f"{place}: {error}") from None


def _read(group: h5py.Group, name: str, kind: Kind, place: str) -> Value:
    if isinstance(kind, UnionType):  # with None: it may be missing
        missing = group.get(name, getlink=True) is None
        return None if missing else _read(group, name, get_args(kind)[0], place)
    if is_dataclass(kind):
        return _read_fields(_group(group, name, place), kind, place)
    origin: Kind = get_origin(kind)
    if origin is not tuple:
        return _text(group, name, place) if kind is str else _numbers(group, name, kind, place)
    member = get_args(kind)[0]
    return _texts(group, name, place) if member is str else _members(group, name, member, place)


def _members(group: h5py.Group, name: str, kind: Kind, place: str) -> tuple[Value, ...]:
    members = _group(group, name, place)
    if len(members) > _MOST_MEMBERS:
        raise ReportFileError(f"{place} has {len(members)} members: at most {_MOST_MEMBERS} are read")
    numbers = [str(number) for number in range(len(members))]
    return tuple(_read_fields(_group(members, n, f"{place}/{n}"), kind, f"{place}/{n}") for n in numbers)


def _numbers(group: h5py.Group, name: str, kind: Kind, place: str) -> Value:
    """A number, or an array of the type and at most the precision that the field declares."""
    scalar = kind in (float, int, bool)
    due = np.dtype(kind if scalar else get_args(get_args(kind)[1])[0])
    dataset = _dataset(group, name, place)
    if dataset.dtype.kind != due.kind:
        raise ReportFileError(f"{place} holds {dataset.dtype}: {due} is due")
    if scalar and dataset.shape != ():
        raise ReportFileError(f"{place} has shape {dataset.shape}: one value is due")
    values = np.asarray(dataset[()], dtype=due)
    return values.item() if scalar else values


def _text(group: h5py.Group, name: str, place: str) -> str:
    dataset = _text_dataset(group, name, place)
    if dataset.shape != ():
        raise ReportFileError(f"{place} has shape {dataset.shape}: one text is due")
    return str(dataset.asstr("utf-8", "strict")[()])


def _texts(group: h5py.Group, name: str, place: str) -> tuple[str, ...]:
    dataset = _text_dataset(group, name, place)
    if dataset.ndim != 1:
        raise ReportFileError(f"{place} has shape {dataset.shape}: a list of texts is due")
    return tuple(str(text) for text in dataset.asstr("utf-8", "strict")[:])


def _text_dataset(group: h5py.Group, name: str, place: str) -> h5py.Dataset:
    dataset = _dataset(group, name, place)
    if h5py.check_string_dtype(dataset.dtype) is None:
        raise ReportFileError(f"{place} holds {dataset.dtype}: text is due")
    return dataset


def _group(group: h5py.Group, name: str, place: str) -> h5py.Group:
    found = _here(group, name, place)
    if not isinstance(found, h5py.Group):
        raise ReportFileError(f"{place} is no group: it must hold the fields of its part of the page")
    return found


def _dataset(group: h5py.Group, name: str, place: str) -> h5py.Dataset:
    found = _here(group, name, place)
    if not isinstance(found, h5py.Dataset) or found.shape is None:
        raise ReportFileError(f"{place} is no dataset: values are due")
    if found.size * found.dtype.itemsize > _MOST_BYTES:
        raise ReportFileError(f"{place} has {found.size} values: more than any page draws")
    return found


def _here(group: h5py.Group, name: str, place: str) -> Value:
    """A member; ``open_hdf5`` has refused links."""
    if name not in group:
        raise ReportFileError(f"{place} is missing")
    return group[name]
