"""What a file is that was given where a model is due, and what to do with it instead."""

from __future__ import annotations

from pathlib import Path

from rigctl.foreign_endings import ENDINGS

__all__ = ["not_a_model"]


def not_a_model(path: Path) -> str:
    """One line on what is wrong and what would be right; "" where the file may be a model in JSON."""
    if path.is_dir():
        return f"{path}: a folder where a model is due: name the model file in it"
    if not path.is_file():
        return ""  # the reader says it
    ending = path.suffix.casefold()
    with path.open("rb") as file:
        if file.read(8) == b"\x89HDF\r\n\x1a\n":
            return f"{path}: an HDF5 file where a model is due: the model stands first, and the runs after it"
    if ending == ".toml":
        return f"{path}: a TOML file where a model is due: a design or a plan is no model; models are JSON"
    if ending in ENDINGS:
        return (
            f"{path}: measured data where a model is due: 'damper-rig import' makes a run of it; the model stands first"
        )
    return ""
