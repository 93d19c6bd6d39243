"""``damper-rig study sensitivity``: how much each parameter of a model changes its force."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import part_of, to_file

__all__ = ["sensitivity"]


def sensitivity(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The physical model.")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", callback=to_file, metavar="PAGE.html", help="One page that opens offline."),
    ],
    config: Annotated[
        Path | None,
        typer.Option("--config", metavar="STUDY.toml", help="Operating point, parameters, levels and network."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", metavar="ELEMENT.PARAMETER", help="A parameter that varies, repeatable; else all free ones."
        ),
    ] = None,
    at: Annotated[
        Path | None, typer.Option("--at", metavar="RUN.h5", help="A sine test that states the operating point.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of networks and samples; 1 where not given.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the shares as JSON, SI units.")] = False,
) -> None:
    """Sensitivity of the force to each parameter: network and Garson's weights, variance, one at a time, local slope.

    Without a configuration: a sine of 10 mm at 4 Hz and 0.8 A, five levels of each parameter from 0.5 to 1.5 times
    its value. An interrupted study goes on where it was: what is done stands in PAGE.html.part.

    Example: damper-rig study sensitivity model.json -o sensitivity.html
    """
    from api.cli.terminal import answer, progress_bar
    from api.errors import InputError
    from excitation.configuration import read_config, to_spec
    from identification.compute import chosen
    from identification.measured import read_runs
    from identification.physical.modelfile import read_model
    from identification.studies.sensitivity import (
        Sensitivity,
        at_run,
        sensitivity_data,
        sensitivity_text,
        write_sensitivity,
    )
    from identification.studies.sensitivity import sensitivity as studied

    if output.suffix != ".html":
        raise InputError(f"{output}: the study is a web page: end its name in .html")
    keys = {} if config is None else read_config(config)
    keys |= {key: value for key, value in {"vary": vary, "seed": seed}.items() if value is not None}
    asked, start = to_spec(Sensitivity, keys, "" if config is None else str(config)), read_model(model)
    if at is not None:
        asked = at_run(asked, read_runs([at]))
    with chosen(os.environ), progress_bar("simulating") as tell:
        found = studied(start, asked, tell=tell, journal=part_of(output))
    write_sensitivity(output, found)
    answer(f"{sensitivity_text(found)}\n{output}", {"file": str(output), **sensitivity_data(found)}, as_json=as_json)
