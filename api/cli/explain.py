"""``damper-rig explain``: what the simulation is missing."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = ["explain", "in_words"]


def explain(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="The simulation as it is today: .json or .fmu.")],
    runs: Annotated[
        list[Path] | None, typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")
    ] = None,
    *,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the report.")],
    held_out: Annotated[
        list[Path] | None, typer.Option(metavar="RUN.h5", help="Runs that no fit may see; can be repeated.")
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="No MODEL.json: the runs hold your simulation, channel force_simulated.")
    ] = False,
    fmu_input: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL=VARIABLE", help="Input of the FMU that a channel drives; can be repeated."),
    ] = None,
    fmu_output: Annotated[
        str, typer.Option(metavar="VARIABLE", help="The damper's force among the FMU's outputs; -VARIABLE reverses it.")
    ] = "",
    fmu_set: Annotated[
        list[str] | None, typer.Option(metavar="VARIABLE=VALUE", help="Parameter of the FMU; can be repeated.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink.

    Example: damper-rig explain model.json runs/*.h5 --held-out check.h5 -o report
    """
    from api.cli.fmu import fmu_choice
    from api.cli.terminal import answer, progress_bar
    from identification.compute import chosen
    from identification.discrepancy import explain as explain_gap
    from identification.discrepancy import report_data, write_report
    from identification.physical.modelfile import read_model
    from rigctl.runfile import read_run

    paths = [model, *(runs or [])] if simulated else runs or []
    if not paths:
        raise typer.BadParameter("give at least one measured run", param_hint="RUN.h5 ...")
    foreign = None if simulated else fmu_choice(model, fmu_input or [], fmu_output, fmu_set or [])
    base = None if simulated or foreign else read_model(model)
    measured = [read_run(path) for path in paths]
    kept = [read_run(path) for path in held_out or []]
    if foreign is not None:
        from identification.fmu import with_fmu

        with progress_bar("simulating") as tell:
            driven = with_fmu(model, [*measured, *kept], foreign, on_progress=tell)
        measured, kept = driven[: len(measured)], driven[len(measured) :]
    with chosen(os.environ), progress_bar("explaining") as tell:
        found = explain_gap(base, measured, kept or None, on_progress=lambda text, done: tell(done, text))
    options = {"--held-out": held_out, "--fmu-input": fmu_input, "--fmu-set": fmu_set, "-o": [output]}
    options |= {"--fmu-output": [fmu_output]} if fmu_output else {}
    given = [text for option, values in options.items() for value in values or [] for text in (option, str(value))]
    flags = ["--simulated"] if simulated else []
    command = shlex.join(["damper-rig", "explain", str(model), *map(str, runs or []), *flags, *given])
    write_report(found, output, reproduce=command)
    report = report_data(found)
    answer("\n".join([*in_words(report), str(output / "report.html")]), report, as_json=as_json)


def in_words(report: Mapping[str, Any]) -> list[str]:
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
