"""``damper-rig convert``: run files to and from the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["convert"]


def convert(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="A run: .h5, .csv or .mat.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="Output; the ending sets the format.")],
) -> None:
    """Export a run file to .csv (spreadsheets) or .mat (MATLAB), or import one from them.

    Example: damper-rig convert run.h5 -o run.mat
    """
    from api.cli.run_formats import read_any, write_any

    write_any(output, read_any(source))
    print(output)
