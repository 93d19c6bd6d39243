"""``damper-rig characterise``: the characteristic sheet of a damper from its sine tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["characterise"]


def characterise(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Sine tests of one damper.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="SHEET.html", help="One page that opens offline.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON, SI units.")] = False,
) -> None:
    """Loops, PVP and CVP curves, dynamic stiffness and loss factor of sine tests.

    Example: damper-rig characterise runs/*.h5 -o sheet.html
    """
    from api.cli.terminal import answer, warn
    from api.errors import InputError
    from identification.sheet import write_sheet
    from rigctl.runfile import read_run

    if output.suffix != ".html":
        raise InputError(f"{output}: the sheet is a web page: end its name in .html")
    measured = [read_run(path) for path in runs]
    warn(measured)
    rows = write_sheet(output, measured)
    answer(f"{output}: {len(rows)} tests", {"file": str(output), "tests": rows}, as_json=as_json)
