"""Excitation files in HDF5: the layout of a run file, `format` "damper-rig/excitation"."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.attributes import number, shown, text, version, whole
from excitation.errors import DesignError, ExcitationFileError
from excitation.kinds import Kind
from excitation.signal import JSON, Excitation
from excitation.untrusted import open_hdf5, parse_json

__all__ = [
    "FORMAT",
    "check_layout",
    "get_excitation",
    "get_figures",
    "get_json",
    "get_kind",
    "hdf5_bytes",
    "put_attributes",
    "put_channels",
    "put_excitation",
    "read_hdf5",
    "write_hdf5",
]

FORMAT = "damper-rig/excitation"
VERSION = 1

_UNITS = {"displacement_command": "m", "current_command": "A"}
_REPEATED = ("coverage", "coverage_normalised")
"""Figures that are attributes too, for whoever looks for files that cover well."""
_MEANING = {
    "displacement_command": "set-point, positive in extension",
    "current_command": "set-point, held between samples",
}


def write_hdf5(path: Path, excitation: Excitation) -> None:
    """Writes one excitation; the same excitation gives the same bytes."""
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        put_excitation(file, excitation)


def hdf5_bytes(excitation: Excitation) -> bytes:
    """The content of an excitation file; the same excitation gives the same bytes."""
    with h5py.File("excitation.h5", "w", libver=("earliest", "v110"), driver="core", backing_store=False) as file:
        put_excitation(file, excitation)
        file.flush()
        content: bytes = file.id.get_file_image()
        return content


def read_hdf5(path: Path) -> Excitation:
    """Reads one excitation; raises ExcitationFileError that names file, channel and first bad sample."""
    with open_hdf5(path, ExcitationFileError) as file:
        return get_excitation(file, str(path))


def put_excitation(group: h5py.Group, excitation: Excitation) -> None:
    """Attributes and channels below ``group``."""
    put_attributes(group, excitation)
    group.attrs["current"] = int(excitation.current_a is not None)
    put_channels(group, excitation)


def put_attributes(group: h5py.Group, excitation: Excitation) -> None:
    """What is stated beside the samples."""
    group.attrs["format"] = FORMAT
    group.attrs["format_version"] = VERSION
    group.attrs["sample_rate"] = excitation.sample_rate_hz
    group.attrs["samples"] = excitation.samples
    group.attrs["period_samples"] = excitation.period_samples
    group.attrs["excitation_kind"] = str(excitation.kind)
    group.attrs["design"] = json.dumps(excitation.design)
    group.attrs["figures"] = json.dumps(excitation.figures)
    for name in _REPEATED:
        if name in excitation.figures:
            group.attrs[name] = excitation.figures[name]


def put_channels(group: h5py.Group, excitation: Excitation) -> None:
    """The samples."""
    channels = group.create_group("channels")
    _put_channel(channels, "displacement_command", excitation.displacement_m)
    if excitation.current_a is not None:
        _put_channel(channels, "current_command", excitation.current_a)


def _put_channel(channels: h5py.Group, name: str, values: NDArray[np.float64]) -> None:
    data = channels.create_dataset(name, data=values)
    data.attrs["unit"] = _UNITS[name]
    data.attrs["description"] = _MEANING[name]


def get_excitation(group: h5py.Group, where: str) -> Excitation:
    """The excitation below ``group``; ``where`` begins every message."""
    check_layout(group, where)
    displacement = _channel(group, "displacement_command", where)
    current = _channel(group, "current_command", where) if "channels/current_command" in group else None
    if "current" in group.attrs and bool(whole(group, "current", where)) is not (current is not None):
        raise ExcitationFileError(f"{where}: channel current_command is not what current says: write the file again")
    samples = whole(group, "samples", where)
    for name, values in (("displacement_command", displacement), ("current_command", current)):
        if values is not None and values.size != samples:
            raise ExcitationFileError(f"{where}: channel {name} has {values.size} samples: the file says {samples}")
    try:
        return Excitation(
            kind=get_kind(group, where),
            sample_rate_hz=number(group, "sample_rate", where),
            period_samples=whole(group, "period_samples", where),
            displacement_m=displacement,
            current_a=current,
            design=get_json(group, "design", where),
            figures=get_figures(group, where),
        )
    except DesignError as error:
        raise ExcitationFileError(f"{where}: {error}") from error


def check_layout(group: h5py.Group, where: str) -> None:
    """Raises ExcitationFileError where ``group`` is not laid out as an excitation of a version that is known."""
    layout = text(group, "format", where)
    if layout != FORMAT:
        raise ExcitationFileError(f"{where}: format is {shown(layout)}: an excitation file has {FORMAT!r}")
    version(group, where, VERSION)


def get_kind(group: h5py.Group, where: str) -> Kind:
    """The kind that the attributes state; raises ExcitationFileError."""
    stated = text(group, "excitation_kind", where)
    if stated not in tuple(Kind):
        raise ExcitationFileError(f"{where}: excitation_kind is {shown(stated)}: known are {', '.join(Kind)}")
    return Kind(stated)


def get_figures(group: h5py.Group, where: str) -> Mapping[str, JSON]:
    """What the design achieved; raises ExcitationFileError where the attributes that repeat a figure differ from it."""
    figures = get_json(group, "figures", where)
    for name in _REPEATED:
        if name in group.attrs and number(group, name, where) != figures.get(name):
            raise ExcitationFileError(f"{where}: {name} is {group.attrs[name]:g}: figures says {figures.get(name)}")
    return figures


def get_json(group: h5py.Group, name: str, where: str) -> Mapping[str, JSON]:
    """The object in the attribute ``name``, empty where there is none; raises ExcitationFileError."""
    if name not in group.attrs:
        return {}
    try:
        value = parse_json(text(group, name, where))
    except ExcitationFileError:
        raise
    except ValueError as error:
        raise ExcitationFileError(f"{where}: attribute {name} is not JSON: {error}") from error
    if not isinstance(value, dict):
        raise ExcitationFileError(f"{where}: attribute {name} is not a JSON object: it must be a table of keys")
    return value


def _channel(group: h5py.Group, name: str, where: str) -> NDArray[np.float64]:
    data = group.get(f"channels/{name}")
    if not isinstance(data, h5py.Dataset):
        raise ExcitationFileError(f"{where}: channel {name} is missing: an excitation needs it")
    unit = data.attrs.get("unit")
    if not isinstance(unit, str) or unit != _UNITS[name]:
        raise ExcitationFileError(f"{where}: channel {name} has unit {shown(unit)}: it must be {_UNITS[name]!r}")
    if data.ndim != 1 or not np.issubdtype(data.dtype, np.floating):
        raise ExcitationFileError(
            f"{where}: channel {name} is {data.dtype} {data.shape}: it must be a 1-D array of floats"
        )
    values = np.asarray(data[()], dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ExcitationFileError(f"{where}: channel {name}, sample {bad[0]} is {values[bad[0]]}: it must be finite")
    return values
