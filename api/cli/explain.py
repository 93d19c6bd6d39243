"""``damper-rig explain``: what the simulation is missing."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.places import to_folder

__all__ = ["explain"]


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Your present simulation: .json or .fmu.")],
    runs: Annotated[
        list[Path] | None, typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")
    ] = None,
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, metavar="DIR", help="Folder of the report.")
    ],
    held_out: Annotated[
        list[Path] | None, typer.Option(metavar="RUN.h5", help="Run that is not used for fitting; can be repeated.")
    ] = None,
    simulated: Annotated[
        bool,
        typer.Option(
            "--simulated", help="Without MODEL.json: the runs contain your simulated force in channel force_simulated."
        ),
    ] = False,
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Find where simulation and measurement differ, name the missing effect, add it to the model, show the gap left.

    Example: damper-rig explain model.json runs/*.h5 --held-out check.h5 -o report
    """
    from api.cli.terminal import answer, ask, progress_bar, show_findings
    from identification.compute import chosen
    from identification.discrepancy import explain_any, questions, report_data, write_report
    from identification.measured import read_runs
    from identification.models import load_model
    from identification.report import report_lines

    paths = [model, *(runs or [])] if simulated else runs or []
    if not paths:
        raise typer.BadParameter("give at least one measured run", param_hint="RUN.h5 ...")
    given = None if simulated else load_model(model, fmu_choice([model], fmu_input, fmu_output, fmu_set))
    every = read_runs([*paths, *(held_out or [])], once=True)
    measured, kept = every[: len(paths)], every[len(paths) :]
    with chosen(os.environ), progress_bar("explaining") as tell:
        found = explain_any(given, measured, kept or None, on_progress=tell)
    show_findings(found.findings)
    ask(questions(found))
    options = {"--held-out": held_out, "--fmu-input": fmu_input, "--fmu-set": fmu_set, "--fmu-output": [fmu_output]}
    command = _command([model, *(runs or [])], options, output, simulated=simulated)
    write_report(found, output, reproduce=command, runs=every)
    report = report_data(found)
    answer("\n".join([*report_lines(report), str(output / "report.html")]), report, as_json=as_json)


def _command(
    files: Sequence[Path], options: Mapping[str, Sequence[Path | str] | None], output: Path, *, simulated: bool
) -> str:
    """The command that repeats this explanation."""
    given = [(name, str(value)) for name, values in options.items() for value in values or [] if str(value)]
    words = [word for option in given for word in option]
    flags = ["--simulated"] if simulated else []
    return shlex.join(["damper-rig", "explain", *map(str, files), *flags, *words, "-o", str(output)])
