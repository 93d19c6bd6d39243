"""Attributes of an HDF5 object as texts and numbers: whatever else stands there is refused in one line."""

from __future__ import annotations

from math import isfinite
from typing import Any

import h5py
import numpy as np

from excitation.errors import ExcitationFileError

__all__ = ["number", "shown", "text", "version", "whole"]

_MOST_WHOLE = 2**53
"""The largest number up to which a float64 holds every whole one."""


def text(group: h5py.Group, name: str, where: str) -> str:
    """The text in the attribute ``name``; raises ExcitationFileError where it is missing or something else."""
    value = _value(group, name, where)
    if not isinstance(value, str):
        raise ExcitationFileError(f"{where}: {name} is {shown(value)}: it must be a text")
    return value


def number(group: h5py.Group, name: str, where: str) -> float:
    """The finite number in the attribute ``name``; raises ExcitationFileError."""
    value = _value(group, name, where)
    if not isinstance(value, int | float | np.integer | np.floating) or not isfinite(float(value)):
        raise ExcitationFileError(f"{where}: {name} is {shown(value)}: it must be a finite number")
    return float(value)


def whole(group: h5py.Group, name: str, where: str) -> int:
    """The whole number, 0 or more, in the attribute ``name``; raises ExcitationFileError."""
    value = number(group, name, where)
    if not 0 <= value <= _MOST_WHOLE or value != int(value):
        raise ExcitationFileError(f"{where}: {name} is {value:g}: it must be a whole number, 0 to {_MOST_WHOLE:g}")
    return int(value)


def version(group: h5py.Group, where: str, newest: int) -> int:
    """The version of the layout; raises ExcitationFileError where this release does not know it."""
    found = whole(group, "format_version", where)
    if not 1 <= found <= newest:
        raise ExcitationFileError(f"{where}: format_version is {found}: this release reads up to {newest}")
    return found


def _value(group: h5py.Group, name: str, where: str) -> Any:
    """Any: whatever HDF5 holds."""
    if name not in group.attrs:
        raise ExcitationFileError(f"{where}: attribute {name} is missing: the file is no excitation or damaged")
    value = group.attrs[name]
    try:
        return value.decode() if isinstance(value, bytes) else value
    except UnicodeDecodeError as error:
        raise ExcitationFileError(f"{where}: {name} is {shown(value)}: it must be UTF-8 text") from error


def shown(value: Any) -> str:
    """A value from elsewhere on one line, at most 60 characters. Any: whatever HDF5 holds."""
    plain = value.item() if isinstance(value, np.generic) else value
    words = " ".join(repr(plain).split())
    return words if len(words) <= 60 else words[:57] + "…"
