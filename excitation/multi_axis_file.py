"""Files of multi-axis excitations: HDF5 with a group for each realisation, CSV with a column for each command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from excitation.atomic import written_whole
from excitation.configuration import to_config
from excitation.errors import ExcitationFileError
from excitation.multi_axis import MultiAxis, MultiAxisSpec

__all__ = ["FORMAT", "multi_axis_facts", "write_multi_axis"]

FORMAT = "damper-rig/multi-axis-excitation"
_VERSION = 1


def write_multi_axis(path: Path | str, made: MultiAxis) -> None:
    """Writes the file whole or not at all. Raises ExcitationFileError for another ending than .h5 or .csv."""
    path = Path(path)
    if path.suffix.lower() not in (".h5", ".csv"):
        raise ExcitationFileError(f"{path}: the ending {path.suffix!r} is not known: use .h5, .csv")
    with written_whole(path, ExcitationFileError) as temporary:
        (_write_csv if path.suffix.lower() == ".csv" else _write_hdf5)(temporary, made)


def multi_axis_facts(spec: MultiAxisSpec) -> dict[str, Any]:
    """What a design comes to: axes, realisations, samples and duration (s) of each. Any: JSON."""
    samples = spec.period_samples * spec.periods
    return {
        "axes": [axis.name for axis in spec.axes],
        "realisations": spec.realisations,
        "samples": samples,
        "duration_s": samples / spec.sample_rate_hz,
    }


def _write_hdf5(path: Path, made: MultiAxis) -> None:
    spec = made.spec
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = _VERSION
        file.attrs["sample_rate"] = spec.sample_rate_hz
        file.attrs["samples"] = spec.period_samples * spec.periods
        file.attrs["period_samples"] = spec.period_samples
        file.attrs["realisations"] = spec.realisations
        file.attrs["design"] = json.dumps(to_config(spec))
        for number, commands in enumerate(made.commands, start=1):
            channels = file.create_group(f"realisation_{number}/channels")
            for axis, command in zip(spec.axes, commands, strict=True):
                data = channels.create_dataset(f"{axis.name}_command", data=np.tile(command, spec.periods))
                data.attrs["unit"] = axis.unit
                data.attrs["description"] = f"set-point of the axis {axis.name}"


def _write_csv(path: Path, made: MultiAxis) -> None:
    spec = made.spec
    samples = spec.period_samples * spec.periods
    heads = [f"{axis.name}_{number} ({axis.unit})" for number in range(1, spec.realisations + 1) for axis in spec.axes]
    columns = np.tile(made.commands.reshape(-1, spec.period_samples), spec.periods)
    table = np.vstack([np.arange(samples) / spec.sample_rate_hz, columns]).T
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=",".join(["time (s)", *heads]), comments="")
