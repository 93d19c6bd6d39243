"""``damper-rig study complexity``: how complex a damper model must be for a validation plan."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import part_of, to_file

__all__ = ["complexity"]


def complexity(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The full physical model.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    plan: Annotated[
        Path,
        typer.Option("--plan", metavar="PLAN.toml", help="The steps of the validation plan, each with its output."),
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", callback=to_file, metavar="PAGE.html", help="One page that opens offline."),
    ],
    feasible: Annotated[
        Path | None,
        typer.Option(
            "--feasible",
            metavar="EXPLORATION.json",
            help="What study explore --json printed: its set states the uncertainty in place of the fit.",
        ),
    ] = None,
    beside: Annotated[
        list[Path] | None,
        typer.Option("--beside", metavar="MODEL", help="Model of any kind to set beside the ladder; repeatable."),
    ] = None,
    simplified: Annotated[
        Path | None,
        typer.Option("--simplified", callback=to_file, metavar="MODEL.json", help="Where the simplified model goes."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the study as JSON, SI units.")] = False,
) -> None:
    """What each element of a model is worth in the vehicle: measure more, keep or simplify; the ladder of models.

    An interrupted study goes on where it was: what is done stands in PAGE.html.part until the page is written.

    Example: damper-rig study complexity model.json runs/*.h5 --plan plan.toml -o complexity.html
    """
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from excitation.atomic import written_whole
    from excitation.configuration import read_config, to_spec
    from identification.compute import chosen
    from identification.errors import OutputError
    from identification.measured import read_runs
    from identification.models import load_model
    from identification.physical.modelfile import read_model, write_model
    from identification.studies.complexity import (
        Plan,
        complexity_data,
        complexity_text,
        plan_of_tests,
        write_complexity,
    )
    from identification.studies.complexity import complexity as studied
    from identification.studies.complexity.feasible import read_feasible
    from identification.studies.journal import kept

    if output.suffix != ".html":
        raise InputError(f"{output}: the study is a web page: end its name in .html")
    asked, full = to_spec(Plan, read_config(plan), str(plan)), read_model(model)
    known = [] if feasible is None else read_feasible(feasible)
    others, measured = [load_model(path) for path in beside or ()], read_runs(runs, once=True)
    for step in asked.step:
        step.check(full)
    with chosen(os.environ), kept(part_of(output)), progress_bar("fitting") as tell:
        found = studied(full, measured, asked.step, matters=asked.matters, feasible=known, beside=others, tell=tell)
    warn(measured)  # only now: a refusal is one line
    write_complexity(output, found)
    if simplified is not None:
        write_model(simplified, found.simplified)
    tests, said = plan_of_tests(found), complexity_text(found)
    if tests:
        designs = output.with_name(f"{output.stem}-tests.toml")
        with written_whole(designs, OutputError) as temporary:
            temporary.write_text(tests, encoding="utf-8")
        said += f"\n{designs}: the tests to measure more, for damper-rig design"
    answer(f"{said}\n{output}", {"file": str(output), **complexity_data(found)}, as_json=as_json)
