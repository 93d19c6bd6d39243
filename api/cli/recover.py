"""``damper-rig recover``: close run files that a crash left open."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["recover"]


def recover(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the run files, searched with its subfolders.")
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print the closed files as JSON.")] = False,
) -> None:
    """Close run files that a crash left open as 'truncated'; every sample on the disk is kept.

    Example: damper-rig recover lab/runs
    """
    from api.cli.terminal import answer
    from rigctl.recover import recover_directory

    found = recover_directory(directory)
    value = [
        {
            "orphan": str(one.orphan),
            "file": None if one.path is None else str(one.path),
            "samples": one.samples,
            "reason": one.reason,
        }
        for one in found
    ]
    lines = [
        f"{one.orphan}: {one.reason}" if one.path is None else f"{one.path}: {one.samples} samples" for one in found
    ]
    answer("\n".join(lines) or f"{directory}: no run file was left open", value, as_json=as_json)
    if any(one.path is None for one in found):
        raise typer.Exit(1)
