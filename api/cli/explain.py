"""``damper-rig explain``: what the simulation is missing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["explain"]


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The simulation as it is today.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the report.")],
    held_out: Annotated[
        list[Path] | None, typer.Option(metavar="RUN.h5", help="Runs that no fit may see; can be repeated.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink.

    Example: damper-rig explain model.json runs/*.h5 --held-out check.h5 -o report
    """
    from api.cli.terminal import answer, progress_bar
    from identification.discrepancy import explain as explain_gap
    from identification.discrepancy import write_report
    from identification.physical.modelfile import read_model
    from rigctl.runfile import read_run

    base = read_model(model)
    measured = [read_run(path) for path in runs]
    kept = [read_run(path) for path in held_out or []]
    with progress_bar("explaining"):
        found = explain_gap(base, measured, kept or None)
    write_report(found, output)
    answer(str(output / "report.html"), {}, as_json=as_json)
