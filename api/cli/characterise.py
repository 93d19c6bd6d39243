"""``damper-rig characterise``: the characteristic sheet of a damper from its sine tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.places import to_file

__all__ = ["characterise"]


def characterise(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Sine tests of one damper.")],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", callback=to_file, metavar="SHEET.html", help="The sheet, one page that opens offline."
        ),
    ],
    model: Annotated[
        Path | None, typer.Option("--model", metavar="MODEL", help="Model to draw with the tests: .json or .fmu.")
    ] = None,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures as JSON, SI units; model new --sheet reads them.")
    ] = False,
) -> None:
    """Loops, PVP and CVP curves, dynamic stiffness and loss factor of sine tests.

    Example: damper-rig characterise runs/*.h5 -o sheet.html
    """
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from identification.measured import read_runs
    from identification.models import load_model
    from identification.sheet import sheet_of, sheet_to_json, write_sheet

    if output.suffix != ".html":
        raise InputError(f"{output}: the sheet is a web page: end its name in .html")
    given = fmu_choice([] if model is None else [model], fmu_input, fmu_output, fmu_set)
    beside = None if model is None else load_model(model, given)
    measured = read_runs(runs)
    with progress_bar("characterising"):
        sheet = sheet_of(measured, beside)
        write_sheet(output, sheet)
    warn(measured)  # only now: a refusal is one line
    answer(f"{output}: {len(sheet.tests)} tests", {"file": str(output), **sheet_to_json(sheet)}, as_json=as_json)
