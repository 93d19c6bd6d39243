"""``damper-rig convert``: run files to and from the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.options import AsJson
from api.cli.places import to_file

__all__ = ["convert"]


def convert(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="A run: .h5, .csv or .mat.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", callback=to_file, metavar="FILE", help="Output; the ending sets the format."),
    ],
    as_json: AsJson = False,
) -> None:
    """Export a run file to .csv (spreadsheets) or .mat (MATLAB), or import one from them.

    Example: damper-rig convert run.h5 -o run.mat
    """
    from api.cli.run_formats import read_any, write_any
    from api.cli.terminal import answer

    write_any(output, read_any(source))
    answer(str(output), {"file": str(output)}, as_json=as_json)
