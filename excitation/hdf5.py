"""Excitation files in HDF5: the layout of a run file, `format` "damper-rig/excitation"."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError, ExcitationFileError
from excitation.kinds import Kind
from excitation.signal import JSON, Excitation
from excitation.untrusted import open_hdf5, parse_json

__all__ = [
    "FORMAT",
    "get_excitation",
    "get_json",
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
    for name in ("coverage", "coverage_normalised"):
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
    layout = _attribute(group, "format", where)
    if layout != FORMAT:
        raise ExcitationFileError(f"{where}: format is {layout!r}: an excitation file has {FORMAT!r}")
    version = int(_attribute(group, "format_version", where))
    if version > VERSION:
        raise ExcitationFileError(f"{where}: format_version is {version}: this release reads up to {VERSION}")
    displacement = _channel(group, "displacement_command", where)
    current = _channel(group, "current_command", where) if "channels/current_command" in group else None
    samples = int(_attribute(group, "samples", where))
    for name, values in (("displacement_command", displacement), ("current_command", current)):
        if values is not None and values.size != samples:
            raise ExcitationFileError(f"{where}: channel {name} has {values.size} samples: the file says {samples}")
    try:
        return Excitation(
            kind=Kind(_attribute(group, "excitation_kind", where)),
            sample_rate_hz=float(_attribute(group, "sample_rate", where)),
            period_samples=int(_attribute(group, "period_samples", where)),
            displacement_m=displacement,
            current_a=current,
            design=get_json(group, "design", where),
            figures=get_json(group, "figures", where),
        )
    except DesignError as error:
        raise ExcitationFileError(f"{where}: {error}") from error
    except ValueError as error:
        raise ExcitationFileError(f"{where}: excitation_kind: {error}: known are {', '.join(Kind)}") from error


def _attribute(group: h5py.Group, name: str, where: str) -> Any:
    """Any: HDF5 attributes are texts or numbers, the caller converts."""
    if name not in group.attrs:
        raise ExcitationFileError(f"{where}: attribute {name} is missing: this is no excitation file")
    return group.attrs[name]


def get_json(group: h5py.Group, name: str, where: str) -> Mapping[str, JSON]:
    """The object in the attribute ``name``, empty where there is none; raises ExcitationFileError."""
    text = group.attrs.get(name, "{}")
    try:
        value = parse_json(text)
    except (TypeError, ValueError) as error:
        raise ExcitationFileError(f"{where}: attribute {name} is not JSON: {error}") from error
    if not isinstance(value, dict):
        raise ExcitationFileError(f"{where}: attribute {name} is not a JSON object: it must be a table of keys")
    return value


def _channel(group: h5py.Group, name: str, where: str) -> NDArray[np.float64]:
    data = group.get(f"channels/{name}")
    if not isinstance(data, h5py.Dataset):
        raise ExcitationFileError(f"{where}: channel {name} is missing: an excitation needs it")
    unit = data.attrs.get("unit")
    if unit != _UNITS[name]:
        raise ExcitationFileError(f"{where}: channel {name} has unit {unit!r}: it must be {_UNITS[name]!r}")
    if data.ndim != 1 or not np.issubdtype(data.dtype, np.floating):
        raise ExcitationFileError(
            f"{where}: channel {name} is {data.dtype} {data.shape}: it must be a 1-D array of floats"
        )
    values = np.asarray(data[()], dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ExcitationFileError(f"{where}: channel {name}, sample {bad[0]} is {values[bad[0]]}: it must be finite")
    return values
