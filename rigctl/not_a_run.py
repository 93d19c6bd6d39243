"""What a file is that was given where a run file is due, and what to do with it instead."""

from __future__ import annotations

import codecs
from pathlib import Path
from typing import Final

from rigctl.foreign_endings import ENDINGS

__all__ = ["not_a_run"]

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"


def not_a_run(path: Path) -> str:
    """One line on what is wrong and what would be right; "" where the file can be a run file, by its first bytes."""
    if path.is_dir():
        return f"{path}: a folder where a run file is due: name its files, for example {path / '*.h5'}"
    if not path.is_file():
        return f"{path}: no such file"
    with path.open("rb") as file:
        start = file.read(512)
    if start.startswith(_SIGNATURE):
        return ""
    ending = path.suffix.casefold()
    if ending in ENDINGS:
        made = path.with_suffix(".h5").name
        return f"{path}: not a run file: make one of it with 'damper-rig import {path.name} -o {made}'"
    if ending == ".toml":
        return f"{path}: a TOML file where a run file is due: 'damper-rig design' and 'damper-rig run' take designs"
    if ending == ".fmu" or _is_json(start):
        return f"{path}: a model where a run file is due: it stands before the runs"
    return (
        f"{path}: damaged or not an HDF5 file, or one with a user block: a run file is due; 'damper-rig import' "
        "makes one of the files of other programs"
    )


def _is_json(start: bytes) -> bool:
    """Whether a file that starts so may be a JSON object: text, with a brace first. One of random bytes is no text."""
    try:
        text = codecs.getincrementaldecoder("utf-8-sig")().decode(start)  # a character cut off at the end is none
    except UnicodeDecodeError:
        return False
    return text.lstrip().startswith("{")
