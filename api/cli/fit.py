"""``damper-rig fit``: the free parameters of a physical model from measured runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["fit"]


def fit(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The model as it is known today.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="MODEL.json", help="The fitted model.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the parameters as JSON.")] = False,
) -> None:
    """Fit the free parameters of a physical model to runs.

    Example: damper-rig fit model.json runs/*.h5 -o fitted.json
    """
    from api.cli.terminal import answer, progress_bar
    from identification.fitting import fit as fit_model
    from identification.physical.modelfile import read_model, write_model
    from rigctl.runfile import read_run

    start = read_model(model)
    measured = [read_run(path) for path in runs]
    with progress_bar("fitting"):
        result = fit_model(start, measured)
    write_model(output, result.model)
    answer(str(result), {}, as_json=as_json)
