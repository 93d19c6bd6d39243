"""``damper-rig study explore``: which parameters a model may have so that it behaves like the measured sine tests."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import part_of, to_file

__all__ = ["explore"]


def explore(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The physical model at its start values.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Sine tests of one damper.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", callback=to_file, metavar="PAGE.html", help="One page that opens offline."),
    ],
    config: Annotated[
        Path | None,
        typer.Option("--config", metavar="STUDY.toml", help="Samples, range, parameters and limits; else as below."),
    ] = None,
    samples: Annotated[int | None, typer.Option("--samples", help="Number of samples; 800 where not given.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", metavar="ELEMENT.PARAMETER", help="A parameter that varies, repeatable; else all free ones."
        ),
    ] = None,
    sampling: Annotated[
        str | None, typer.Option("--sampling", metavar="KIND", help="log-uniform (where not given) or sobol.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the samples; 1 where not given.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the figures and the feasible set as JSON, SI units.")
    ] = False,
) -> None:
    """Feasible parameters: samples of a model that stay within limits of the measured sine tests.

    Kept are samples whose dynamic stiffness, loss angle and loop shape stay within the limits on every test. An
    interrupted study goes on where it was: what is done stands in PAGE.html.part until the page is written.

    Example: damper-rig study explore model.json runs/*.h5 -o exploration.html
    """
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from excitation.configuration import read_config, to_spec
    from identification.compute import chosen
    from identification.measured import read_runs
    from identification.physical.modelfile import read_model
    from identification.studies.exploration import (
        Exploration,
        check_explorable,
        explored_data,
        explored_text,
        write_explored,
    )
    from identification.studies.exploration import explore as explored

    if output.suffix != ".html":
        raise InputError(f"{output}: the exploration is a web page: end its name in .html")
    keys = {} if config is None else read_config(config)
    given = {"samples": samples, "vary": vary, "sampling": sampling, "seed": seed}
    keys |= {key: value for key, value in given.items() if value is not None}
    asked = to_spec(Exploration, keys, "" if config is None else str(config))
    start, measured = read_model(model), read_runs(runs, once=True)
    check_explorable(start, measured, asked)
    with chosen(os.environ), progress_bar("exploring") as tell:
        found = explored(start, measured, asked, tell=tell, journal=part_of(output))
    warn(measured)  # only now: a refusal is one line
    write_explored(output, found)
    answer(f"{explored_text(found)}\n{output}", {"file": str(output), **explored_data(found)}, as_json=as_json)
