"""``damper-rig iterate``: the drive with which the measured motion equals the target."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = ["iterate"]


def iterate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The target motion: an excitation file or a plan.")],
    rig: Annotated[str, typer.Option(help="The rig's address, for example modbus://127.0.0.1:5020.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of drives, charts and run files.")],
    tolerance: Annotated[float, typer.Option(help="Tolerance of the error, % rms of the target.")] = 1.0,
    iterations: Annotated[int, typer.Option(help="Largest number of iterations after the plain command.")] = 5,
    gain: Annotated[float, typer.Option(help="Share of the error that one iteration corrects.")] = 0.9,
    bandwidth: Annotated[
        float | None, typer.Option(help="No correction above this frequency, Hz; default: the band of the target.")
    ] = None,
    cool_to: Annotated[
        float | None, typer.Option(help="Wait before each run until the damper is at or below this temperature, °C.")
    ] = None,
    specimen: Annotated[str, typer.Option(help="Specimen, for the run files.")] = "",
    operator: Annotated[str, typer.Option(help="Operator, for the run files.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Iterate the drive of each test until the measured displacement equals the target.

    Writes NAME.drive.h5 (play it with 'damper-rig run'), NAME.convergence.html and a run file of each iteration.
    Exit status 1: the tolerance was not reached.

    Example: damper-rig iterate road.h5 --rig modbus://127.0.0.1:5020 -o iterated
    """
    from dataclasses import replace
    from functools import partial

    from api.cli.run import plan_of
    from api.cli.terminal import answer, progress_display
    from rigctl.drive import IterationSettings
    from rigctl.iterate import Iterated, Outcome, write_drive
    from rigctl.iterate import iterate as iterated_by
    from rigctl.iterate_plot import write_convergence
    from rigctl.player import connect, file_stem, play
    from rigctl.warm_up import warmed_up

    settings = IterationSettings(gain=gain, bandwidth_hz=bandwidth, tolerance=tolerance / 100, most=iterations)
    plan, transport = plan_of(file), connect(rig)
    found: list[tuple[str, Iterated]] = []
    made: list[dict[str, Any]] = []
    try:
        with progress_display() as display:
            for asked in plan.tests:
                test = asked if cool_to is None else replace(asked, max_temperature_degc=cool_to)
                bar = display.add_task(test.name, total=iterations + 1)
                one = iterated_by(
                    partial(
                        warmed_up,
                        partial(play, transport, specimen=specimen, operator=operator),
                        out_dir=output,
                        warm_up=plan.warm_up,
                    ),
                    test,
                    settings=settings,
                    on_step=lambda step, bar=bar: display.advance(bar),  # type: ignore[misc]  # the default binds it
                )
                found.append((test.name, one))
                drive = output / f"{file_stem(test.name)}.drive.h5"
                chart = output / f"{file_stem(test.name)}.convergence.html"
                write_drive(drive, one)
                write_convergence(chart, test.name, one)
                made.append(
                    {
                        "test": test.name,
                        "outcome": str(one.outcome),
                        "errors": [step.error for step in one.steps],
                        "drive": str(drive),
                        "chart": str(chart),
                        "runs": [str(step.run) for step in one.steps],
                    }
                )
    finally:
        transport.close()
    answer("\n".join(_line(name, one, made[k]["drive"]) for k, (name, one) in enumerate(found)), made, as_json=as_json)
    if any(one.outcome is not Outcome.CONVERGED for _, one in found):
        raise typer.Exit(1)


def _line(name: str, iterated: Any, drive: str) -> str:  # Any: rigctl is imported only when the command runs
    errors = " → ".join(f"{100 * step.error:.2f}" for step in iterated.steps)
    return f"{drive}: {name}: {iterated.outcome}, error {errors} % rms"
