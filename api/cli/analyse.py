"""``damper-rig analyse``: what a periodic test says before any model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import to_file

__all__ = ["analyse"]


def analyse(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN.h5 ...",
            help="Periodic runs: realisations of a design, or one with its periods; of several levels each by itself.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", callback=to_file, metavar="PAGE.html", help="The plots, one page that opens offline."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON, SI units.")] = False,
) -> None:
    """Linear part of the force (best linear approximation), odd and even distortion, noise, change over the run.

    Example: damper-rig analyse runs/level_1*.h5 -o analysis.html
    """
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from identification.analysis import analyse_levels, levels_data, levels_text, write_analysis
    from identification.measured import read_runs

    if output is not None and output.suffix != ".html":
        raise InputError(f"{output}: the analysis is a web page: end its name in .html")
    measured = read_runs(runs, once=True)
    with progress_bar("analysing"):
        found = analyse_levels(measured)
        if output is not None:
            write_analysis(output, found)
    warn(measured)
    said = levels_text(found) if output is None else f"{levels_text(found)}\n{output}"
    answer(said, ({} if output is None else {"file": str(output)}) | levels_data(found), as_json=as_json)
