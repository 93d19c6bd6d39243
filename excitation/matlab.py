"""Excitation files for MATLAB (.mat, version 5), one variable for each thing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from excitation.errors import ExcitationFileError
from excitation.kinds import Kind
from excitation.signal import Excitation
from excitation.untrusted import check_mat, parse_json

__all__ = ["read_mat", "read_variables", "write_mat"]


def write_mat(path: Path, excitation: Excitation) -> None:
    """Columns `time`, `displacement_command`, `current_command`, and what describes them."""
    from scipy.io import savemat

    variables: dict[str, Any] = {  # Any: what MATLAB knows, numbers, texts and arrays
        "format": "damper-rig/excitation",
        "sample_rate": excitation.sample_rate_hz,
        "period_samples": float(excitation.period_samples),
        "excitation_kind": str(excitation.kind),
        "time": np.arange(excitation.samples) / excitation.sample_rate_hz,
        "displacement_command": excitation.displacement_m,
        "design": json.dumps(excitation.design),
        "figures": json.dumps(excitation.figures),
    }
    if excitation.current_a is not None:
        variables["current_command"] = excitation.current_a
    savemat(path, variables, oned_as="column", do_compression=True, appendmat=False)


def read_mat(path: Path) -> Excitation:
    """Reads `displacement_command` (m), `sample_rate` (Hz) and, where they are there, the other variables.

    Raises ExcitationFileError that names the variable.
    """
    found = read_variables(path)
    for name in ("displacement_command", "sample_rate"):
        if name not in found:
            own = ", ".join(key for key in found if not key.startswith("__"))
            raise ExcitationFileError(f"{path}: variable {name} is missing: the file has {own or 'none'}")
    try:
        return Excitation(
            kind=Kind(str(found.get("excitation_kind", Kind.CUSTOM))),
            sample_rate_hz=float(found["sample_rate"]),
            period_samples=int(found.get("period_samples", 0)),
            displacement_m=np.atleast_1d(np.asarray(found["displacement_command"], dtype=np.float64)),
            current_a=_row(found.get("current_command")),
            design=parse_json(str(found.get("design", "{}"))),
            figures=parse_json(str(found.get("figures", "{}"))),
        )
    except (ValueError, TypeError) as error:
        raise ExcitationFileError(f"{path}: {error}") from error


def read_variables(path: Path) -> dict[str, Any]:
    """Every variable of a MAT file, version 5. Any: what MATLAB knows.

    Raises ExcitationFileError where it cannot be read.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    check_mat(path)
    try:
        return dict(loadmat(path, squeeze_me=True))
    except NotImplementedError as error:
        raise ExcitationFileError(f"{path}: MATLAB 7.3 files are not read: save it with '-v7'") from error
    except (MatReadError, ValueError, TypeError) as error:
        raise ExcitationFileError(f"{path}: no MATLAB file: {error}") from error


def _row(values: Any) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """Any: whatever the file holds under the name."""
    return None if values is None else np.atleast_1d(np.asarray(values, dtype=np.float64))
