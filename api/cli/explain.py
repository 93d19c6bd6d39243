"""``damper-rig explain``: what the simulation is missing."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice

if TYPE_CHECKING:
    from identification.discrepancy.explanation import Explanation

__all__ = ["explain", "report_lines"]


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Your present simulation: .json or .fmu.")],
    runs: Annotated[
        list[Path] | None, typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")
    ] = None,
    *,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the report.")],
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
    from api.cli.terminal import answer, progress_bar, warn
    from identification.compute import chosen
    from identification.discrepancy import explain as explain_gap
    from identification.discrepancy import report_data, write_report
    from identification.discrepancy.foreign import as_base
    from identification.measured import read_runs
    from identification.models import load_model

    paths = [model, *(runs or [])] if simulated else runs or []
    if not paths:
        raise typer.BadParameter("give at least one measured run", param_hint="RUN.h5 ...")
    given = None if simulated else load_model(model, fmu_choice([model], fmu_input, fmu_output, fmu_set))
    every = read_runs([*paths, *(held_out or [])], once=True)
    measured, kept = every[: len(paths)], every[len(paths) :]
    base = None
    if given is not None:
        with progress_bar("simulating") as tell:
            base, driven = as_base(given, [*measured, *kept], on_progress=tell)
        measured, kept = driven[: len(measured)], driven[len(measured) :]
    with chosen(os.environ), progress_bar("explaining") as tell:
        found = explain_gap(base, measured, kept or None, on_progress=lambda text, done: tell(done, text))
    warn([*measured, *kept])  # only now: a refusal is one line
    _ask(found)
    options = {"--held-out": held_out, "--fmu-input": fmu_input, "--fmu-set": fmu_set, "--fmu-output": [fmu_output]}
    write_report(found, output, reproduce=_command([model, *(runs or [])], options, output, simulated=simulated))
    report = report_data(found)
    answer("\n".join([*report_lines(report), str(output / "report.html")]), report, as_json=as_json)


def _ask(found: Explanation) -> None:
    """Questions about the input that the result raises."""
    from api.cli.terminal import ask
    from identification.discrepancy import far_as_given
    from identification.fitting import moved_far

    ask([*far_as_given(found.traces), *moved_far(found.given, found.base.model)])


def _command(
    files: Sequence[Path], options: Mapping[str, Sequence[Path | str] | None], output: Path, *, simulated: bool
) -> str:
    """The command that repeats this explanation."""
    given = [(name, str(value)) for name, values in options.items() for value in values or [] if str(value)]
    words = [word for option in given for word in option]
    flags = ["--simulated"] if simulated else []
    return shlex.join(["damper-rig", "explain", *map(str, files), *flags, *words, "-o", str(output)])


def report_lines(report: Mapping[str, Any]) -> list[str]:
    """The verdict, the names, the gap on held-out runs and the next test, a line each. Any: the JSON of the report."""
    gap = report["gap"]["held_out"]
    lines = [f"verdict: {report['verdict'].replace('_', ' ')}"]
    for effect in report["effects"]:
        values = ", ".join(f"{n} = {p['value']:.4g} {p['unit']}".rstrip() for n, p in effect["parameters"].items())
        lines.append(
            f"missing: {effect['element']} on the {effect['path']} path, "
            f"confidence {effect['confidence']:.2f} ({values})"
        )
    lines.append(
        f"held-out gap: {gap['as_given']:.4g} N as given, {gap['base_refitted']:.4g} N refitted, "
        f"{gap['final']:.4g} N explained, noise floor {gap['noise_floor']:.4g} N"
    )
    if report["next_test"]["text"]:
        lines.append(f"next test: {report['next_test']['text']}")
    return lines
