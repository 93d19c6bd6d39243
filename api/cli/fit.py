"""``damper-rig fit``: the free parameters of a physical model from measured runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import spare_runs, to_file

__all__ = ["fit"]


def fit(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The model with start values.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_file, metavar="MODEL.json", help="The fitted model.")
    ],
    starts: Annotated[int, typer.Option("--starts", help="Number of starts; the best fit is kept.")] = 1,
    robust: Annotated[
        float | None,
        typer.Option("--robust", help="Huber threshold, in noise standard deviations."),
    ] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Fit smooth forms of friction and hysteresis where the runs show them.")
    ] = False,
    profiled: Annotated[
        list[str] | None,
        typer.Option(
            "--profile",
            metavar="ELEMENT.PARAMETER",
            help="Parameter whose interval is computed by profile likelihood; can be repeated.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the parameters as JSON.")] = False,
) -> None:
    """Fit the free parameters of a physical model to runs.

    Example: damper-rig fit model.json runs/*.h5 -o fitted.json
    """
    from api.cli.terminal import answer, ask, progress_bar, warn
    from identification.compute import chosen
    from identification.fitting import fit_as_asked, fit_data, fit_text, moved_far
    from identification.measured import read_runs
    from identification.physical.modelfile import read_model, write_model

    spare_runs(output, runs)
    start = read_model(model)
    measured = read_runs(runs, once=True)
    with chosen(os.environ), progress_bar("fitting") as tell:
        result, intervals = fit_as_asked(
            start, measured, starts=starts, robust=robust, refine=refine, profile=profiled or (), tell=tell
        )
    warn(measured)  # only now: a refusal is one line
    write_model(output, result.model)
    ask(moved_far(start, result.model))
    text = f"{output}: {fit_text(result, intervals)}"
    answer(text, {"file": str(output), **fit_data(result, intervals)}, as_json=as_json)
